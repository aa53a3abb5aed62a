// Stage light: unshadowed light from the hierarchy, and the shadow samples picked on the way (LY19 3.2, 3.3).
#pragma once

#include "lab/params.h"
#include "lab/records.h"

namespace lab {

struct LightingData {
    std::vector<vec3> irradiance;
    std::vector<std::uint32_t> overdraw, lights_used;  // (levels, H, W)
    std::vector<std::int32_t> light;                   // (H, W, k)
    std::vector<float> target_weight, weight_sum;      // (H, W, k), (H, W)
};

LightingData light(const HierarchyView& hierarchy, const GBufferView& gbuffer, const Params& params,
                   float scene_radius);

// The level that shadow samples are picked from, up (LY19 4.1).
int first_pick_level(const HierarchyView& hierarchy, const Params& params);

// What a light counts for in its interleaving tile: n^2 where it is dealt, else 1.
float deal_scale(const HierarchyView& hierarchy, int level, const Params& params);

}  // namespace lab
