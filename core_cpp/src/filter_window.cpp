// The filters whose weights differ at a pair's two ends or whose window is wide: every tap is weighed.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/filter_window.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: these are compiled for each instruction set.
#include "lab/filter_pass.h"
#include "lab/filter_weights.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// See plane_line.
class PlaneGuide {
  public:
    struct Row {
        const float *value, *surface;
        std::size_t stride;
        float per_step;    // 1 / (sigma footprint) is for step 1
        float per_normal;  // squared

        Row shifted(int by) const { return {value + by, surface + by, stride, per_step, per_normal}; }
    };

    HWY_INLINE PlaneGuide(const Row& row, int x) {
        const Lanes f32;
        const float* at = row.surface + x;
        value_ = hn::LoadU(f32, row.value + x);
        a_ = hn::LoadU(f32, at);
        b_ = hn::LoadU(f32, at + row.stride);
        c_ = hn::LoadU(f32, at + 2 * row.stride);
        x_ = hn::LoadU(f32, at + 3 * row.stride);
        y_ = hn::LoadU(f32, at + 4 * row.stride);
        z_ = hn::LoadU(f32, at + 5 * row.stride);
        per_length_ = hn::Mul(hn::LoadU(f32, at + 6 * row.stride), hn::Set(f32, row.per_step));
        per_normal_ = hn::Set(f32, row.per_normal);
    }

    HWY_INLINE Vector distance(const PlaneGuide& q, Vector more) const {
        const auto v = hn::Sub(q.value_, value_);
        const auto along_xy = hn::MulAdd(b_, hn::Sub(q.y_, y_), hn::Mul(a_, hn::Sub(q.x_, x_)));
        const auto plane = hn::Mul(hn::MulAdd(c_, hn::Sub(q.z_, z_), along_xy), per_length_);
        const auto normals = squared_distance(q.a_, q.b_, q.c_, a_, b_, c_, hn::Zero(Lanes()));
        return hn::MulAdd(normals, per_normal_, hn::MulAdd(plane, plane, hn::MulAdd(v, v, more)));
    }

  private:
    Vector value_, a_, b_, c_, x_, y_, z_, per_length_, per_normal_;
};

template <class Guide>
struct Tap {
    typename Guide::Row guide;
    const float* q;
    float space;
};

template <class Guide>
using Taps = std::vector<Tap<Guide>>;

// What is summed is the *difference* to the pixel's own value: a constant stays exact.
template <int channels, class Guide>
void mix_line(const FilterPass& pass, const typename Guide::Row& guide, const Taps<Guide>& taps, float centre, int y) {
    const Lanes f32;
    const std::size_t stride = pass.in.stride();
    const float* own = pass.in.row(0, y);
    float* filtered = pass.out.row(0, y);
    for (int x = 0; x < pass.in.width(); x += static_cast<int>(hn::Lanes(f32))) {
        const Guide at(guide, x);
        Vector p[channels], change[channels];
        for (int c = 0; c < channels; ++c) {
            p[c] = hn::Load(f32, own + c * stride + x);
            change[c] = hn::Zero(f32);
        }
        auto sum = hn::Set(f32, centre);
        for (const Tap<Guide>& tap : taps) {
            const auto near = exp2_negative(at.distance(Guide(tap.guide, x), hn::Zero(f32)));
            const auto weight = hn::Mul(near, hn::Set(f32, tap.space));
            sum = hn::Add(sum, weight);
            for (int c = 0; c < channels; ++c)
                change[c] = hn::MulAdd(weight, hn::Sub(hn::LoadU(f32, tap.q + c * stride + x), p[c]), change[c]);
        }
        for (int c = 0; c < channels; ++c)
            hn::Store(hn::Add(p[c], hn::Div(change[c], sum)), f32, filtered + c * stride + x);
    }
}

template <class Guide, class RowOf>
void filter_line(const FilterPass& pass, const SpatialKernel& kernel, int step, const RowOf& row_of, int y) {
    const int radius = kernel.radius();
    Taps<Guide> taps;
    for (int dy = -radius; dy <= radius; ++dy) {
        const int line = reflected(y + dy * step, step, pass.in.height());
        for (int dx = -radius; dx <= radius; ++dx)
            if (dx != 0 || dy != 0)
                taps.push_back({row_of(line).shifted(dx * step), pass.in.row(0, line) + dx * step,
                                kernel.weight[dy + radius] * kernel.weight[dx + radius]});
    }
    const float centre = kernel.weight[radius] * kernel.weight[radius];
    if (pass.in.count() == 2) mix_line<2, Guide>(pass, row_of(y), taps, centre, y);
    if (pass.in.count() == 4) mix_line<4, Guide>(pass, row_of(y), taps, centre, y);
    if (pass.in.count() == 6) mix_line<6, Guide>(pass, row_of(y), taps, centre, y);
}

void bilateral(const FilterPass& pass, const SpatialKernel& kernel, int y) {
    const auto row_of = [&](int line) {
        return JointGuide::Row{pass.value.row(0, line), {pass.surfaces.row(0, line), pass.surfaces.stride()}};
    };
    filter_line<JointGuide>(pass, kernel, 1, row_of, y);
}

void plane(const FilterPass& pass, const SpatialKernel& kernel, int step, float per_normal, int y) {
    const auto row_of = [&](int line) {
        return PlaneGuide::Row{pass.value.row(0, line), pass.surfaces.row(0, line), pass.surfaces.stride(),
                               1.0f / static_cast<float>(step), per_normal * per_normal};
    };
    filter_line<PlaneGuide>(pass, kernel, step, row_of, y);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(bilateral);
HWY_EXPORT(plane);

void bilateral_line(const FilterPass& pass, const SpatialKernel& kernel, int y) {
    HWY_DYNAMIC_DISPATCH(bilateral)(pass, kernel, y);
}

void plane_line(const FilterPass& pass, const SpatialKernel& kernel, int step, float per_normal, int y) {
    HWY_DYNAMIC_DISPATCH(plane)(pass, kernel, step, per_normal, y);
}

}  // namespace lab
#endif
