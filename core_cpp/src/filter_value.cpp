#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/filter_value.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: these are compiled for each instruction set.
#include "lab/filter_pass.h"
#include "lab/filter_weights.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

void values(const Planes& signal, const ValueScale& scale, int y, int x0, int x1, Planes& value) {
    const Lanes f32;
    const auto zero = hn::Zero(f32);
    const float* over = signal.row(0, y);
    const float* under = signal.row(scale.numerators, y);
    const std::size_t next = signal.stride(), next_under = signal.count() == 2 * scale.numerators ? next : 0;
    for (int x = x0; x < x1; x += static_cast<int>(hn::Lanes(f32))) {
        const auto ratio = [&](int i) {
            const auto weight = hn::Load(f32, under + i * next_under + x);
            return hn::IfThenElseZero(hn::Gt(weight, zero), hn::Div(hn::Load(f32, over + i * next + x), weight));
        };
        auto v = ratio(0);
        if (scale.numerators == 3) v = luminance(v, ratio(1), ratio(2));
        // l / (l + mean), from 0 to 1, without a sum that could leave float's range.
        if (scale.mean_area > 0) {
            const auto one = hn::Set(f32, 1.0f);
            v = hn::Div(one, hn::Add(one, hn::Div(hn::Set(f32, scale.mean_area), v)));
        }
        v = hn::Mul(hn::Min(v, hn::Set(f32, value_limit)), hn::Set(f32, scale.per_value));
        v = hn::Min(hn::Max(v, hn::Set(f32, -guide_limit)), hn::Set(f32, guide_limit));
        hn::Store(hn::Mul(v, hn::Set(f32, guide_scale)), f32, value.row(0, y) + x);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(values);

void take_values(const Planes& signal, const ValueScale& scale, int y, int x0, int x1, Planes& value) {
    HWY_DYNAMIC_DISPATCH(values)(signal, scale, y, x0, x1, value);
}

}  // namespace lab
#endif
