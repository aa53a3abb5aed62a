// The limit of stage light: its own kernel on perfect lists.
#pragma once

#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// Pairs of light and pixel per second, on all threads, that the kernel evaluates with the lobe and picker of `params`
// where every light reaches every lane and lists lie ready in memory. Points and lights are the picture's own. 0 where
// no light reaches a whole group. Takes about `seconds`.
double light_kernel_rate(const HierarchyView& hierarchy, const GBufferView& gbuffer, const Params& params,
                         float scene_radius, double seconds);

}  // namespace lab
