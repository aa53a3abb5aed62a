// Blending functions B_l of the levels: a partition of unity over distance (LY19 2.2, Figure 2).
#pragma once

#include "lab/select.h"

namespace lab {

// B(d) = clamp(min(up, down), 0, 1) with two linear ramps; r = alpha * h_l.
struct Blend {
    float up_slope, up_start;      // (d - r/2) / (r/2), or 1 for the first drawn level
    float down_slope, down_start;  // (2r - d) / r, or 1 for the top
};

inline Blend make_blend(float blend_radius, bool first, bool top) {
    const float inverse = 1.0f / blend_radius;
    return {first ? 0.0f : 2.0f * inverse, first ? 1.0f : -1.0f,  //
            top ? 0.0f : -inverse, top ? 1.0f : 2.0f};
}

inline float blend_weight(const Blend& blend, float distance) {
    const float up = blend.up_slope * distance + blend.up_start;
    const float down = blend.down_slope * distance + blend.down_start;
    return larger(0.0f, smaller(1.0f, smaller(up, down)));
}

}  // namespace lab
