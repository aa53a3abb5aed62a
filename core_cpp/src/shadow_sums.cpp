#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/shadow_sums.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "lab/shadow_sums.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// `constant`: samples a pixel where they are known, so that a loop over pixels needs no gathers; else 0.
template <int constant, bool average>
void sum_row(const SampleRow& row, bool corrected, float* weight, float* shadowed) {
    const std::size_t each = constant > 0 ? constant : static_cast<std::size_t>(row.each);
    const float mean = 1.0f / static_cast<float>(row.each);
    const std::int32_t* light = row.light;
    const float* omega = row.omega;
    const std::uint8_t* free = row.free;
#pragma omp simd
    for (std::size_t p = 0; p < row.pixels; ++p) {
        float sum = 0.0f, seen = 0.0f;
        for (std::size_t s = 0; s < each; ++s) {
            const std::size_t i = p * each + s;
            const float share = (average ? (light[i] >= 0 ? 1.0f : 0.0f) : omega[i]) * mean;
            sum += share;
            seen += free[i] != 0 ? share : 0.0f;
        }
        weight[p] = sum;
        shadowed[p] = seen;
    }
    if (!corrected) return;
    // This estimator does not divide by U: S is relative to 1 wherever something was picked.
    for (std::size_t p = 0; p < row.pixels; ++p) {
        bool any = false;
        for (std::size_t s = 0; s < each; ++s) any |= light[p * each + s] >= 0;
        if (any) weight[p] = 1.0f;
    }
}

template <bool average>
void sum_row(const SampleRow& row, bool corrected, float* weight, float* shadowed) {
    if (row.each == 1)
        sum_row<1, average>(row, corrected, weight, shadowed);
    else if (row.each == 4)
        sum_row<4, average>(row, corrected, weight, shadowed);
    else
        sum_row<0, average>(row, corrected, weight, shadowed);
}

void SumSamples(const SampleRow& row, ShadowEstimator estimator, float* weight, float* shadowed) {
    if (estimator == ShadowEstimator::average)
        sum_row<true>(row, false, weight, shadowed);
    else
        sum_row<false>(row, estimator == ShadowEstimator::corrected, weight, shadowed);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(SumSamples);

void sum_samples(const SampleRow& row, ShadowEstimator estimator, float* weight, float* shadowed) {
    HWY_DYNAMIC_DISPATCH(SumSamples)(row, estimator, weight, shadowed);
}

}  // namespace lab
#endif
