// Point lights in structure-of-arrays form: what every one of them sends to a point, with no hierarchy. Written apart
// from the renderer's own evaluation, which it judges.
#pragma once

#include <vector>

#include "lab/records.h"

namespace lab {

struct AllLights {
    std::vector<float> px, py, pz, nx, ny, nz, isotropic, bright, red, green, blue;
    std::size_t count;

    explicit AllLights(const LightsView& lights);
};

// What decides the falloff of every light: see falloff.h.
struct CommonFalloff {
    float least, more;  // 1 / (max(d^2, least) + more)
};

// Sums over a short run of lights, and how many of them send anything.
struct RunSum {
    float bright, red, green, blue;
    int lit;
};

// Irradiance per flux from each light at a point x with normal n, unshadowed, to `weight`.
void weigh_lights(const AllLights& lights, const vec3& x, const vec3& n, const CommonFalloff& falloff, float* weight);

// Sums of weight times flux over each run of `run` lights, to `sums`.
void sum_runs(const AllLights& lights, const float* weight, std::size_t run, std::vector<RunSum>& sums);

}  // namespace lab
