// The edge-stopping weights of a tap: how much pixel q counts in the mean of pixel p. In vectors of pixels; compiled
// for each instruction set.
#if defined(LAB_FILTER_WEIGHTS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_FILTER_WEIGHTS_H
#undef LAB_FILTER_WEIGHTS_H
#else
#define LAB_FILTER_WEIGHTS_H
#endif

#include <hwy/highway.h>

#include "lab/filter_guides.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, Planes::slack>;
using Vector = hn::Vec<Lanes>;

// 2^-t for t >= 0, relative error below 2e-7, exactly 1 at 0; 0 for t >= limit and for NaN.
HWY_INLINE Vector exp2_negative(Vector t, float limit = weight_limit) {
    const Lanes f32;
#if HWY_TARGET == HWY_AVX3
    const Vector f{_mm512_reduce_ps(t.raw, _MM_FROUND_TO_NEAREST_INT)};  // t = n + f, n whole, |f| <= 1/2
    constexpr float sign = -1.0f;
#else
    const auto shift = hn::Set(f32, 12582912.0f);  // 1.5 * 2^23: a float of this size holds whole numbers only
    const auto whole = hn::Sub(shift, t);
    const auto f = hn::Sub(hn::Sub(shift, whole), t);  // -t = n + f, n whole, |f| <= 1/2
    constexpr float sign = 1.0f;
#endif
    auto power = hn::Set(f32, sign * 0.00132647087f);  // minimax polynomial of 2^f, of 2^-f
    power = hn::MulAdd(power, f, hn::Set(f32, 0.00967151113f));
    power = hn::MulAdd(power, f, hn::Set(f32, sign * 0.0555073395f));
    power = hn::MulAdd(power, f, hn::Set(f32, 0.240222424f));
    power = hn::MulAdd(power, f, hn::Set(f32, sign * 0.693147004f));
    power = hn::MulAdd(power, f, hn::Set(f32, 1.0f));
    const auto counts = hn::Lt(t, hn::Set(f32, limit));
#if HWY_TARGET == HWY_AVX3  // has an instruction for what follows
    return Vector{_mm512_maskz_scalef_ps(counts.raw, power.raw, hn::Sub(f, t).raw)};
#else
    const hn::RebindToSigned<Lanes> i32;
    const auto scaled = hn::Add(hn::BitCast(i32, power), hn::ShiftLeft<23>(hn::BitCast(i32, whole)));
    return hn::IfThenElseZero(counts, hn::BitCast(f32, scaled));
#endif
}

// Of linear RGB; see lab/luminance.h.
HWY_INLINE Vector luminance(Vector r, Vector g, Vector b) {
    const Lanes f32;
    const auto rg = hn::MulAdd(r, hn::Set(f32, 0.2126f), hn::Mul(g, hn::Set(f32, 0.7152f)));
    return hn::MulAdd(b, hn::Set(f32, 0.0722f), rg);
}

HWY_INLINE Vector squared_distance(Vector ax, Vector ay, Vector az, Vector bx, Vector by, Vector bz, Vector more) {
    const auto x = hn::Sub(ax, bx), y = hn::Sub(ay, by), z = hn::Sub(az, bz);
    return hn::MulAdd(z, z, hn::MulAdd(y, y, hn::MulAdd(x, x, more)));
}

// Normal and position of pixels, as guides: their squared distance says how unlike two surfaces are.
class SurfaceGuide {
  public:
    struct Row {
        const float* surface;
        std::size_t stride;

        Row shifted(int by) const { return {surface + by, stride}; }
    };

    HWY_INLINE SurfaceGuide(const Row& row, int x) {
        const Lanes f32;
        const float* at = row.surface + x;
        a_ = hn::LoadU(f32, at);
        b_ = hn::LoadU(f32, at + row.stride);
        c_ = hn::LoadU(f32, at + 2 * row.stride);
        x_ = hn::LoadU(f32, at + 3 * row.stride);
        y_ = hn::LoadU(f32, at + 4 * row.stride);
        z_ = hn::LoadU(f32, at + 5 * row.stride);
    }

    // Plus `more`.
    HWY_INLINE Vector distance(const SurfaceGuide& q, Vector more) const {
        return squared_distance(q.x_, q.y_, q.z_, x_, y_, z_, squared_distance(q.a_, q.b_, q.c_, a_, b_, c_, more));
    }

  private:
    Vector a_, b_, c_, x_, y_, z_;
};

// Value, normal and position, each over its sigma: the filters with one Gaussian of one distance.
class JointGuide {
  public:
    struct Row {
        const float* value;
        SurfaceGuide::Row surface;

        Row shifted(int by) const { return {value + by, surface.shifted(by)}; }
    };

    HWY_INLINE JointGuide(const Row& row, int x)
        : value_(hn::LoadU(Lanes(), row.value + x)), surface_(row.surface, x) {}

    // Plus `more`.
    HWY_INLINE Vector distance(const JointGuide& q, Vector more) const {
        const auto v = hn::Sub(q.value_, value_);
        return surface_.distance(q.surface_, hn::MulAdd(v, v, more));
    }

  private:
    Vector value_;
    SurfaceGuide surface_;
};

}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
