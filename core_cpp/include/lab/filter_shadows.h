// Stage filter_shadows: the fused edge-stopping filters (LY19 3.3).
#pragma once

#include <span>

#include "lab/buffer.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// Row-major (H, W, channels) signals as they come from trace_shadow_rays.
struct ShadowSignalView {
    int channels;                             // 1, or 3 for ratio_rgb
    std::span<const float> shadowed, weight;  // (H, W, channels)
    std::span<const vec3> area;               // (H, W)
};

struct ShadowSignal {
    Buffer<float> shadowed, weight;
    Buffer<vec3> area;
};

// Filters S and its weight with one shared set of tap weights, and the area lights' irradiance with its own.
// The same numbers for any number of threads. A pixel's result never leaves the range of its taps.
ShadowSignal filter_shadows(const GBufferView& gbuffer, const ShadowSignalView& signal, const Params& params,
                            float scene_radius);

// Filters noisy irradiance (H, W), guided by itself and by the surfaces: what area lights send, what the clamp leaves
// out.
Buffer<vec3> filter_irradiance(const GBufferView& gbuffer, std::span<const vec3> irradiance, const Params& params,
                               float scene_radius);

}  // namespace lab
