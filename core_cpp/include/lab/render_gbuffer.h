// Stage render_gbuffer: what the camera sees, one ray through each pixel's centre.
#pragma once

#include "lab/camera.h"

namespace lab {

struct GBufferData {
    std::vector<vec3> position, normal, geometric_normal, albedo, emission;
    std::vector<float> depth;
    float pixel_angle;
};

GBufferData render_gbuffer(const Scene& scene, const Camera& camera, int width, int height);

}  // namespace lab
