// The sum over all lights, with no hierarchy: every light at every pixel, and a shadow ray to each, or to as many as
// the budget allows.
#pragma once

#include "lab/params.h"
#include "lab/records.h"
#include "lab/scene.h"

namespace lab {

struct BruteForceData {
    std::vector<glm::dvec3> unshadowed, irradiance, variance;  // of rows * width pixels; variance of the estimate
    std::int64_t exact_pixels = 0;                             // pixels whose every contributing light got its ray
};

struct RowRange {
    int first, last;  // one past
};

// Irradiance of some rows of pixels. A pixel with more than `draws` contributing lights draws that many in proportion
// to the luminance they send unshadowed: two in each of draws / 2 strata, over the lights in their given order
// (neighbours in space should be neighbours in it). draws = 0: every light. `pass` numbers independent estimates. Of
// the settings falloff, clamp_distance and seed count.
BruteForceData brute_force(const Scene& scene, const LightsView& lights, const GBufferView& gbuffer,
                           const RowRange& rows, int draws, std::uint32_t pass, const Params& params);

}  // namespace lab
