// The edge-stopping weights of a tap: how much pixel q counts in the mean of pixel p. In vectors of pixels; compiled
// for each instruction set.
#if defined(LAB_FILTER_WEIGHTS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_FILTER_WEIGHTS_H
#undef LAB_FILTER_WEIGHTS_H
#else
#define LAB_FILTER_WEIGHTS_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "lab/filter_guides.h"

// Of lambdas: compilers inline neither all nor always those that kernels are made of.
#ifndef LAB_INLINE
#define LAB_INLINE __attribute__((always_inline))
#endif

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, Planes::slack>;
using Vector = hn::Vec<Lanes>;

#if HWY_TARGET == HWY_AVX3
// 2^-(i / 16), and i in the bits that those of a shifted number will take away again.
alignas(64) inline constexpr std::uint32_t sixteenth_powers[16] = {
    0x3f800000, 0x3f7d257d, 0x3f7ac0c7, 0x3f78ccdf, 0x3f7744fd, 0x3f76248c, 0x3f75672a, 0x3f7508a4,
    0x3f7504f3, 0x3f75583f, 0x3f75fed7, 0x3f76f532, 0x3f7837f0, 0x3f79c3d3, 0x3f7b95c2, 0x3f7daac3};
#endif

// 2^-t for t >= 0, relative error below 6e-7, exactly 1 at 0; 0 for t >= limit and for NaN.
HWY_INLINE Vector exp2_negative(Vector t, float limit = weight_limit) {
    const Lanes f32;
    const hn::RebindToSigned<Lanes> i32;
    const auto counts = hn::Lt(t, hn::Set(f32, limit));
#if HWY_TARGET == HWY_AVX3                       // a register is a table
    const auto shift = hn::Set(f32, 786432.0f);  // 1.5 * 2^19: a float of this size holds whole sixteenths only
    const auto sixteenths = hn::Add(t, shift);   // t = n / 16 + f, n whole and in the last bits, |f| <= 1/32
    const auto f = hn::Sub(t, hn::Sub(sixteenths, shift));
    const auto n = hn::BitCast(i32, sixteenths);
    const auto table = hn::Load(i32, reinterpret_cast<const std::int32_t*>(sixteenth_powers));
    const decltype(n) power{_mm512_permutexvar_epi32(n.raw, table.raw)};  // looks at the last four bits
    const auto scale = hn::BitCast(f32, hn::Sub(power, hn::ShiftLeft<19>(n)));
    const auto slope = hn::MulAdd(f, hn::Set(f32, 0.240226507f), hn::Set(f32, -0.693187833f));  // minimax: 2^-f
    return Vector{_mm512_maskz_fmadd_ps(counts.raw, hn::Mul(scale, f).raw, slope.raw, scale.raw)};
#else
    const auto shift = hn::Set(f32, 12582912.0f);  // 1.5 * 2^23: a float of this size holds whole numbers only
    const auto whole = hn::Sub(shift, t);
    const auto f = hn::Sub(hn::Sub(shift, whole), t);  // -t = n + f, n whole, |f| <= 1/2
    auto power = hn::Set(f32, 0.00132647087f);         // minimax polynomial of 2^f
    power = hn::MulAdd(power, f, hn::Set(f32, 0.00967151113f));
    power = hn::MulAdd(power, f, hn::Set(f32, 0.0555073395f));
    power = hn::MulAdd(power, f, hn::Set(f32, 0.240222424f));
    power = hn::MulAdd(power, f, hn::Set(f32, 0.693147004f));
    power = hn::MulAdd(power, f, hn::Set(f32, 1.0f));
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

        void prefetch(int x) const {
            for (int plane = 0; plane < 6; ++plane) hwy::Prefetch(surface + plane * stride + x);
        }
    };

    SurfaceGuide() = default;
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

        void prefetch(int x) const {
            hwy::Prefetch(value + x);
            surface.prefetch(x);
        }
    };

    JointGuide() = default;
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
