// The limit of the stages that trace rays: Embree alone, on the very rays of a stage in its order and packets.
#pragma once

#include "lab/camera.h"
#include "lab/params.h"
#include "lab/records.h"
#include "lab/scene.h"

namespace lab {

struct RayLimit {
    std::int64_t rays;
    double seconds;  // median of the repetitions, all threads
};

// Rays of all light paths, also of those that come too late to leave a light.
RayLimit limit_vpl_rays(const Scene& scene, const Params& params, int repetitions);
RayLimit limit_gbuffer_rays(const Scene& scene, const Camera& camera, int width, int height, int repetitions);
// Rays to the shadow samples' points and to the scene's own lights.
RayLimit limit_shadow_rays(const Scene& scene, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                           const LightingView& lighting, const Params& params, int repetitions);

}  // namespace lab
