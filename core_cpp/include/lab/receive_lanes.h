// What one grid light sends to many points at once: contribution.h's `receive`, on vectors of the instruction set that
// is being compiled for. Roots are taken by the processor's estimate and Newton's step, to 2e-7.
#if defined(LAB_RECEIVE_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_RECEIVE_LANES_H
#undef LAB_RECEIVE_LANES_H
#else
#define LAB_RECEIVE_LANES_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "lab/light_group.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// A group's lanes: one vector of AVX-512, two of AVX2, four of SSE or NEON.
using Lanes = hn::CappedTag<float, group_lanes>;
using Vec = hn::Vec<Lanes>;

HWY_INLINE Vec all(float value) {
    return hn::Set(Lanes(), value);
}

// 1 / sqrt(x) for x >= the least normal number.
HWY_INLINE Vec inverse_root(Vec x) {
    const Vec half = hn::Mul(all(0.5f), x);
    Vec y = hn::ApproximateReciprocalSqrt(x);
    for (int step = 0; step < (HWY_ARCH_ARM ? 2 : 1); ++step)  // from 12 bits or more, or NEON's 8
        y = hn::Mul(y, hn::NegMulAdd(hn::Mul(half, y), y, all(1.5f)));
    return y;
}

HWY_INLINE Vec root(Vec x) {
    return hn::Mul(x, inverse_root(hn::Max(x, all(std::numeric_limits<float>::min()))));
}

HWY_INLINE Vec dot(Vec ax, Vec ay, Vec az, Vec bx, Vec by, Vec bz) {
    return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
}

// w^T moment w.
HWY_INLINE Vec square_along(Vec xx, Vec yy, Vec zz, Vec xy, Vec xz, Vec yz, Vec vx, Vec vy, Vec vz) {
    const Vec x = hn::MulAdd(xx, vx, hn::MulAdd(xy, vy, hn::Mul(xz, vz)));
    const Vec y = hn::MulAdd(yy, vy, hn::Mul(yz, vz));
    return dot(x, y, hn::Mul(zz, vz), vx, vy, vz);
}

// A soft receiver's cosine, lane by lane (an error function has no vector form here).
HWY_INLINE Vec softened(const ReadyLight& light, Vec cosine, Vec distance, Vec spread) {
    const Lanes d;
    float c[group_lanes], r[group_lanes], s[group_lanes];
    hn::StoreU(cosine, d, c);
    hn::StoreU(distance, d, r);
    hn::StoreU(spread, d, s);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i)
        c[i] = r[i] > light.inner_radius ? softened_cosine(c[i], s[i]) : larger(0.0f, c[i]);
    return hn::LoadU(d, c);
}

// Irradiance per intensity. `clamp2`: squared clamp distance.
template <bool soft, bool clamped>
HWY_INLINE Vec receive_lanes(const ReadyLight& light, Vec clamp2, Vec px, Vec py, Vec pz, Vec nx, Vec ny, Vec nz) {
    const Vec zero = hn::Zero(Lanes()), least = all(std::numeric_limits<float>::min());
    const Vec vx = hn::Sub(all(light.position.x), px), vy = hn::Sub(all(light.position.y), py),
              vz = hn::Sub(all(light.position.z), pz);
    const Vec d2 = dot(vx, vy, vz, vx, vy, vz);
    const Vec inverse = inverse_root(hn::Max(d2, least)), distance = hn::Mul(d2, inverse);

    Vec cosine = hn::Mul(dot(nx, ny, nz, vx, vy, vz), inverse);
    if constexpr (soft) {
        const Vec sx = hn::Mul(nx, all(light.deviation.x)), sy = hn::Mul(ny, all(light.deviation.y)),
                  sz = hn::Mul(nz, all(light.deviation.z));
        cosine = softened(light, cosine, distance, hn::Mul(root(dot(sx, sy, sz, sx, sy, sz)), inverse));
    } else {
        cosine = hn::Max(zero, cosine);
    }

    const EmissionLobe& lobe = light.lobe;
    const Symmetric& m = lobe.moment;
    const Vec square = square_along(all(m.xx), all(m.yy), all(m.zz), all(m.xy), all(m.xz), all(m.yz), vx, vy, vz);
    const Vec along = dot(all(lobe.mean.x), all(lobe.mean.y), all(lobe.mean.z), vx, vy, vz);
    const Vec sum = hn::Sub(root(hn::Max(zero, square)), along);  // the vectors point to the light
    const Vec emitted = hn::Add(hn::Max(zero, hn::Mul(sum, inverse)), all(lobe.constant));

    const Blend& blend = light.blend;
    const Vec up = hn::MulAdd(all(blend.up_slope), distance, all(blend.up_start));
    const Vec down = hn::MulAdd(all(blend.down_slope), distance, all(blend.down_start));
    const Vec weight = hn::Max(zero, hn::Min(all(1.0f), hn::Min(up, down)));

    // G = 1 / max(d^2, c^2) is the smaller of two inverses, one of which is known.
    const Vec falloff = clamped ? hn::Min(hn::Mul(inverse, inverse), hn::Div(all(1.0f), hn::Max(clamp2, least)))
                                : hn::Div(all(1.0f), hn::Max(hn::Add(d2, clamp2), least));
    return hn::Mul(hn::Mul(hn::Mul(weight, cosine), emitted), falloff);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
