// The edge-stopping weights of a tap: how much pixel q counts in the mean of pixel p.
#pragma once

#include <bit>
#include <cstdint>

#include "lab/filter_planes.h"

namespace lab {

// Weights are exp(-e) = 2^-t. Guides are stored times sqrt(log2(e) / 2), so that t is their squared distance.
inline constexpr float guide_scale = 0.849321800f;
inline constexpr float guide_limit = 1e18f;    // larger guides count as this: a squared distance stays finite
inline constexpr float weight_limit = 100.0f;  // 2^-100 and less is no weight
inline constexpr float never = 1e30f;          // a distance that leaves no weight

// 2^-t for t >= 0, relative error below 2e-7, exactly 1 at 0; 0 for t >= weight_limit and for NaN.
inline float exp2_negative(float t) {
    constexpr float shift = 12582912.0f;  // 1.5 * 2^23: a float of this size holds whole numbers only
    const float whole = shift - t;
    const float f = (shift - whole) - t;  // -t = n + f, n whole, |f| <= 1/2
    float power = 0.00132647087f;         // minimax polynomial of 2^f
    power = power * f + 0.00967151113f;
    power = power * f + 0.0555073395f;
    power = power * f + 0.240222424f;
    power = power * f + 0.693147004f;
    power = power * f + 1.0f;
    const auto scaled = std::bit_cast<std::uint32_t>(power) + (std::bit_cast<std::uint32_t>(whole) << 23);
    return t < weight_limit ? std::bit_cast<float>(scaled) : 0.0f;
}

// `count` pixels p = (x ..., row_p), each with the tap q = (x + shift ..., row_q) of spatial weight `space`.
struct TapRow {
    int x, count, row_p, row_q, shift;
    float space;
};

// atrous, bilateral: distance in the space of (value, normal, position), each over its sigma.
struct JointGuide {
    const Planes& value;     // 1 plane
    const Planes& geometry;  // normal x y z, position x y z

    void weigh(const TapRow& tap, float* weight) const {
        const auto p = [&](const Planes& planes, int i) { return planes.row(i, tap.row_p) + tap.x; };
        const auto q = [&](const Planes& planes, int i) { return planes.row(i, tap.row_q) + tap.x + tap.shift; };
        const float *vp = p(value, 0), *vq = q(value, 0);
        const float *ap = p(geometry, 0), *aq = q(geometry, 0), *bp = p(geometry, 1), *bq = q(geometry, 1);
        const float *cp = p(geometry, 2), *cq = q(geometry, 2), *xp = p(geometry, 3), *xq = q(geometry, 3);
        const float *yp = p(geometry, 4), *yq = q(geometry, 4), *zp = p(geometry, 5), *zq = q(geometry, 5);
#pragma omp simd
        for (int i = 0; i < tap.count; ++i) {
            const float v = vq[i] - vp[i], a = aq[i] - ap[i], b = bq[i] - bp[i], c = cq[i] - cp[i];
            const float x = xq[i] - xp[i], y = yq[i] - yp[i], z = zq[i] - zp[i];
            weight[i] = tap.space * exp2_negative(v * v + a * a + b * b + c * c + x * x + y * y + z * z);
        }
    }
};

// atrous_plane: distance of q from p's tangent plane, in footprints of p at this pass's step; normals; value.
struct PlaneGuide {
    const Planes& value;     // 1 plane
    const Planes& geometry;  // unit normal x y z, position x y z, per_length, background (0 or `never`)
    float per_step;          // per_length is for step 1
    float per_normal;        // squared

    void weigh(const TapRow& tap, float* weight) const {
        const auto p = [&](const Planes& planes, int i) { return planes.row(i, tap.row_p) + tap.x; };
        const auto q = [&](const Planes& planes, int i) { return planes.row(i, tap.row_q) + tap.x + tap.shift; };
        const float *vp = p(value, 0), *vq = q(value, 0);
        const float *ap = p(geometry, 0), *aq = q(geometry, 0), *bp = p(geometry, 1), *bq = q(geometry, 1);
        const float *cp = p(geometry, 2), *cq = q(geometry, 2), *xp = p(geometry, 3), *xq = q(geometry, 3);
        const float *yp = p(geometry, 4), *yq = q(geometry, 4), *zp = p(geometry, 5), *zq = q(geometry, 5);
        const float *per_length = p(geometry, 6), *outside_p = p(geometry, 7), *outside_q = q(geometry, 7);
#pragma omp simd
        for (int i = 0; i < tap.count; ++i) {
            const float v = vq[i] - vp[i], a = aq[i] - ap[i], b = bq[i] - bp[i], c = cq[i] - cp[i];
            const float height = ap[i] * (xq[i] - xp[i]) + bp[i] * (yq[i] - yp[i]) + cp[i] * (zq[i] - zp[i]);
            const float plane = height * per_length[i] * per_step;
            const float t = plane * plane + (a * a + b * b + c * c) * per_normal + v * v;
            weight[i] = tap.space * exp2_negative(t + outside_p[i] + outside_q[i]);
        }
    }
};

}  // namespace lab
