// Stage trace_shadow_rays: one ray to the stored point of each shadow sample, and the direct light
// (LY19 3.3).
#pragma once

#include "lab/params.h"
#include "lab/records.h"
#include "lab/scene.h"

namespace lab {

struct ShadowData {
    std::vector<vec3> point;              // (H, W, k)
    std::vector<std::int32_t> member;     // (H, W, k)
    std::vector<float> omega;             // (H, W, k)
    std::vector<std::uint8_t> visible;    // (H, W, k)
    int channels;                         // 3 for ratio_rgb, else 1
    std::vector<float> shadowed, weight;  // (H, W, channels)
    std::vector<vec3> direct, area;       // (H, W)
    std::vector<vec3> left_out;           // (H, W), empty without compensation
};

ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                             const LightingView& lighting, const Params& params);

}  // namespace lab
