// Stage trace_shadow_rays: one ray to the stored point of each shadow sample, and the direct light
// (LY19 3.3).
#pragma once

#include "lab/buffer.h"
#include "lab/params.h"
#include "lab/ray_packet.h"
#include "lab/records.h"
#include "lab/scene.h"

namespace lab {

struct ShadowData {
    Buffer<vec3> point;              // (H, W, k)
    Buffer<std::int32_t> member;     // (H, W, k)
    Buffer<float> omega;             // (H, W, k)
    Buffer<std::uint8_t> visible;    // (H, W, k)
    int channels;                    // 3 for ratio_rgb, else 1
    Buffer<float> shadowed, weight;  // (H, W, channels)
    Buffer<vec3> direct, area;       // (H, W)
    std::vector<vec3> left_out;      // (H, W), empty without compensation
};

ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                             const LightingView& lighting, const Params& params);
// The same, with visibility by `trace`, called from any thread with the number of the block (lab/shadow_block.h) that
// the rays are of; without compensation.
ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                             const LightingView& lighting, const Params& params, const TracePacket& trace);

}  // namespace lab
