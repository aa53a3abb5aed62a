// Emission of a grid light toward a direction, from the moments of its members' normals.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "lab/params.h"
#include "lab/records.h"
#include "lab/select.h"

namespace lab {

inline constexpr float isotropic_emission = 0.25f;  // of a light without a normal, 1 / (4 pi) over 1 / pi

// Every kind of lobe in one form: max(0, mean.w + sqrt(w^T moment w)) + constant.
//   moments:      max(0,x) = (x + |x|) / 2 gives (m.w + k sqrt(w^T M w)) / 2: exact for one normal and for
//                 two opposite ones; k = 1 - 0.201 (1 - tr M^2) makes the power right for isotropic normals.
//   mean_energy:  max(0, m.w) + (1 - |m|) / 4, the first moment with its power kept.
//   mean:         max(0, m.w), the authors' demo.
// A light made only of lights without normals is isotropic, 1/4, in each. Where all normals agree each is the
// plain cosine, and is taken as such: behind the light the sums above would cancel only to rounding.
struct EmissionLobe {
    glm::vec3 mean;
    Symmetric moment;  // its mixed terms doubled: w^T moment w = xx x^2 + .. + xy x y + ..
    float constant;
};

inline EmissionLobe make_lobe(Lobe kind, const glm::vec3& m, const Symmetric& M, bool oriented) {
    EmissionLobe lobe{glm::vec3(0.0f), {0, 0, 0, 0, 0, 0}, 0.0f};
    const float spread = M.xx + M.yy + M.zz - glm::dot(m, m);  // E|n|^2 - |E n|^2
    if (!oriented) {
        lobe.constant = isotropic_emission;
    } else if (spread <= 1e-6f) {
        lobe.mean = m;
    } else if (kind == Lobe::moments) {
        const float trace2 = M.xx * M.xx + M.yy * M.yy + M.zz * M.zz + 2.0f * (M.xy * M.xy + M.xz * M.xz + M.yz * M.yz);
        const float half_k = 0.5f * (1.0f - 0.201f * (1.0f - trace2));
        const float s = half_k * half_k;
        lobe.mean = 0.5f * m;
        lobe.moment = {s * M.xx, s * M.yy, s * M.zz, 2 * s * M.xy, 2 * s * M.xz, 2 * s * M.yz};
    } else {
        lobe.mean = m;
        if (kind == Lobe::mean_energy) lobe.constant = 0.25f * larger(0.0f, 1.0f - glm::length(m));
    }
    return lobe;
}

// `v` points from the light to the receiver with length 1/inverse_length.
inline float emission(const EmissionLobe& lobe, float vx, float vy, float vz, float inverse_length) {
    const Symmetric& M = lobe.moment;
    const float square = vx * (M.xx * vx + M.xy * vy + M.xz * vz) + vy * (M.yy * vy + M.yz * vz) + vz * (M.zz * vz);
    const float along = lobe.mean.x * vx + lobe.mean.y * vy + lobe.mean.z * vz;
    const float root = std::sqrt(larger(0.0f, square));
    return larger(0.0f, (along + root) * inverse_length) + lobe.constant;
}

}  // namespace lab
