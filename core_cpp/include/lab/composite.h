// Stage composite: interleaved tiles are recombined, shadows and direct light put together (LY19 4.3).
#pragma once

#include "lab/buffer.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

struct CompositeInput {
    std::span<const vec3> irradiance, direct, area;
    std::span<const float> shadowed, weight;  // (H, W, channels)
    std::span<const vec3> left_out;           // irradiance that the falloff leaves out, or empty
    int channels;
    vec3 background;
};

struct ImageData {
    Buffer<vec3> colour, direct, unshadowed, indirect;
    Buffer<float> shadow_ratio;  // (H, W, channels)
};

ImageData composite(const GBufferView& gbuffer, const CompositeInput& input, const Params& params);

}  // namespace lab
