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

// Some lines of a strip. What is summed is the *difference* to the pixel's own value: a constant stays exact.
template <int channels, int lines>
HWY_INLINE void mix_lines(const Strip& strip, int j, PairRows& pairs, const Planes& in, Planes& out) {
    const Lanes f32;
    const std::size_t stride = in.stride();
    const Windows<lines, 2> windows(strip, j, pairs, in, 0, channels);
    for (int x = 0; x < strip.x1 - strip.x0; x += static_cast<int>(hn::Lanes(f32))) {
        windows.prefetch(x);
        Vector p[lines][channels], change[lines][channels], sum[lines];
        for (int i = 0; i < lines; ++i) {
            for (int c = 0; c < channels; ++c) {
                p[i][c] = hn::Load(f32, in.row(c, strip.row(j + i)) + strip.x0 + x);
                change[i][c] = hn::Zero(f32);
            }
            sum[i] = hn::Set(f32, 1.0f);
        }
        windows.visit(x, [&](const float* at, const auto& each) LAB_INLINE {
            Vector q[channels];
            for (int c = 0; c < channels; ++c) q[c] = hn::LoadU(f32, at + c * stride);
            each([&](int i, Vector weight) LAB_INLINE {
                sum[i] = hn::Add(sum[i], weight);
                for (int c = 0; c < channels; ++c)
                    change[i][c] = hn::MulAdd(weight, hn::Sub(q[c], p[i][c]), change[i][c]);
            });
        });
        for (int i = 0; i < lines; ++i)
            for (int c = 0; c < channels; ++c)
                hn::Store(hn::Add(p[i][c], hn::Div(change[i][c], sum[i])), f32,
                          out.row(c, strip.row(j + i)) + strip.x0 + x);
    }
}

void filter_strip(const FilterPass& pass, const Strip& strip, PairRows& pairs) {
    const auto row_of = [&](int y) {
        return JointGuide::Row{pass.value.row(0, y), {pass.surfaces.row(0, y), pass.surfaces.stride()}};
    };
    const auto weigh = [](const JointGuide& p, const JointGuide& q, float space)
                           LAB_INLINE { return exp2_negative(p.distance(q, hn::Set(Lanes(), space))); };
    for_blocks<2, JointGuide>(strip, pairs, row_of, weigh, [&](int j, auto lines) {
        if (pass.in.count() == 2) mix_lines<2, lines>(strip, j, pairs, pass.in, pass.out);
        if (pass.in.count() == 4) mix_lines<4, lines>(strip, j, pairs, pass.in, pass.out);
        if (pass.in.count() == 6) mix_lines<6, lines>(strip, j, pairs, pass.in, pass.out);
    });
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
