// The limit of stage light: a kernel on perfect lists, the plain one or the stage's own.
#pragma once

#include <vector>

#include "lab/params.h"
#include "lab/records.h"

namespace lab {

enum class LightKernel { plain, own };

// Pairs of light and pixel per second, on all threads, that the kernel evaluates with the lobe and picker of `params`
// where every light reaches every lane and lists lie ready in memory. Points and lights are the picture's own. 0 where
// no light reaches a whole group. Takes about `seconds`.
double light_kernel_rate(LightKernel kernel, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                         const Params& params, float scene_radius, double seconds);

// The irradiance that it finds on the way, lists' pixel by pixel: both kernels do the same work.
std::vector<vec3> light_kernel_sums(LightKernel kernel, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                                    const Params& params, float scene_radius);

}  // namespace lab
