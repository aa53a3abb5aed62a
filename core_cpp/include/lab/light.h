// Stage light: unshadowed light from the hierarchy, and the shadow samples picked on the way (LY19 3.2, 3.3).
#pragma once

#include "lab/buffer.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

struct LightingData {
    Buffer<vec3> irradiance;
    Buffer<std::uint32_t> overdraw, lights_used;  // (levels, H, W), or empty
    Buffer<std::int32_t> light;                   // (H, W, k)
    Buffer<float> target_weight, weight_sum;      // (H, W, k), (H, W)
    std::uint64_t visited = 0;                    // pairs of pixel and light evaluated, idle lanes included
};

// `counts`: whether to count overdraw and lights used.
LightingData light(const HierarchyView& hierarchy, const GBufferView& gbuffer, const Params& params, float scene_radius,
                   bool counts);

// The level that shadow samples are picked from, up (LY19 4.1).
int first_pick_level(const HierarchyView& hierarchy, const Params& params);

// What a light counts for in its interleaving tile: n^2 where it is dealt, else 1.
float deal_scale(const HierarchyView& hierarchy, int level, const Params& params);

}  // namespace lab
