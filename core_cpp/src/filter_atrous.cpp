#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/filter_atrous.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: these are compiled for each instruction set.
#include "lab/filter_pairs.h"
#include "lab/filter_pass.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// One line of a strip. What is summed is the *difference* to the pixel's own value: a constant stays exact.
template <int channels>
void mix_line(const Strip& strip, int j, PairRows& pairs, const Planes& in, Planes& out) {
    const Lanes f32;
    std::array<Tap, 24> taps;
    window(strip, j, 2, pairs, in, taps);
    const std::size_t stride = in.stride();
    const int y = strip.row(j);
    const float* own = in.row(0, y) + strip.x0;
    float* filtered = out.row(0, y) + strip.x0;
    for (int i = 0; i < strip.x1 - strip.x0; i += static_cast<int>(hn::Lanes(f32))) {
        Vector p[channels], change[channels];
        for (int c = 0; c < channels; ++c) {
            p[c] = hn::Load(f32, own + c * stride + i);
            change[c] = hn::Zero(f32);
        }
        auto sum = hn::Set(f32, 1.0f);
        for (const Tap& tap : taps) {
            const auto weight = hn::LoadU(f32, tap.pair + i);
            sum = hn::Add(sum, weight);
            for (int c = 0; c < channels; ++c)
                change[c] = hn::MulAdd(weight, hn::Sub(hn::LoadU(f32, tap.q + c * stride + i), p[c]), change[c]);
        }
        for (int c = 0; c < channels; ++c)
            hn::Store(hn::Add(p[c], hn::Div(change[c], sum)), f32, filtered + c * stride + i);
    }
}

void filter_strip(const FilterPass& pass, const Strip& strip, PairRows& pairs) {
    const Lanes f32;
    const auto row_of = [&](int y) {
        return JointGuide::Row{pass.value.row(0, y), {pass.surfaces.row(0, y), pass.surfaces.stride()}};
    };
    const auto weigh = [&](const JointGuide& p, const JointGuide& q, float space) {
        return exp2_negative(p.distance(q, hn::Set(f32, space)));
    };
    for (int j = strip.first - 2; j < strip.last; ++j) {
        fill_pairs<JointGuide>(strip, j, 2, pairs, row_of, weigh);
        if (j < strip.first) continue;
        if (pass.in.count() == 2) mix_line<2>(strip, j, pairs, pass.in, pass.out);
        if (pass.in.count() == 4) mix_line<4>(strip, j, pairs, pass.in, pass.out);
        if (pass.in.count() == 6) mix_line<6>(strip, j, pairs, pass.in, pass.out);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(filter_strip);

void atrous_strip(const FilterPass& pass, const Strip& strip, PairRows& pairs) {
    HWY_DYNAMIC_DISPATCH(filter_strip)(pass, strip, pairs);
}

}  // namespace lab
#endif
