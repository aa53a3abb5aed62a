// The path tracer: what every pixel should look like, with no virtual lights in between.
#pragma once

#include <optional>

#include "lab/camera.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// Sums over samples of a pixel's values and of their squares.
struct SampleSums {
    std::vector<glm::dvec3> sum, square;

    explicit SampleSums(std::size_t pixels) : sum(pixels, glm::dvec3(0)), square(pixels, glm::dvec3(0)) {}
    void add(std::size_t pixel, const vec3& value) {
        const glm::dvec3 v(value);
        sum[pixel] += v;
        square[pixel] += v * v;
    }
};

// Samples first .. first + count - 1 of every pixel; any split of them into calls gives the same samples.
struct SampleRange {
    std::uint32_t first, count;
};

struct PathSums {
    SampleSums direct, indirect, colour;  // radiance; direct holds the emission that is seen
};

// Next-event estimation at every vertex; light that has bounced 1..max_bounces times is indirect. Where the camera's
// rays meet surfaces comes from the G-buffer (one point a pixel), or, with `camera`, is drawn anew for each sample,
// evenly over the pixel and from full-resolution textures.
PathSums trace_paths(const Scene& scene, const LightsView& list, const GBufferView& gbuffer,
                     const std::optional<Camera>& camera, const SampleRange& samples, const Params& params);

// Irradiance that the falloff of virtual lights leaves out, by short paths (Kollig & Keller 2004): what brings the sum
// over virtual lights back to the path tracer's.
SampleSums trace_compensation(const Scene& scene, const GBufferView& gbuffer, const SampleRange& samples,
                              const Params& params);

}  // namespace lab
