// Light paths followed backwards, from points that are seen: the path tracer's bounces, and the short correction of
// the clamped falloff.
#pragma once

#include <limits>
#include <vector>

#include "lab/falloff.h"
#include "lab/next_event.h"
#include "lab/params.h"

namespace lab {

// The share of light over a distance that the falloff leaves out: 1 - G(d) d^2 (Kollig & Keller, "Illumination in the
// Presence of Weak Singularities", 2004). Default: nothing is left out.
struct Residual {
    Falloff falloff = Falloff::clamped;
    float clamp2 = 0.0f;  // squared clamp distance, in scene units

    float share(float d2) const {
        const float g = falloff == Falloff::clamped ? falloff_clamped(d2, clamp2) : falloff_softened(d2, clamp2);
        return larger(0.0f, 1.0f - g * d2);
    }
    // No light from farther away is left out.
    float reach() const {
        return falloff == Falloff::clamped ? std::sqrt(clamp2) : std::numeric_limits<float>::infinity();
    }
};

// A point on a surface where a path begins or goes on.
struct PathPoint {
    LitPoint at;
    vec3 throughput;
    std::uint32_t path;
    std::size_t slot;
};

class PathWalk {
  public:
    PathWalk(const Scene& scene, const NextEvent& lights, int max_bounces)
        : scene_(scene), lights_(lights), max_bounces_(max_bounces) {}

    // Adds to light[slot] what reaches each point by 1..max_bounces bounces: radiance, averaged over the cosine
    // weighted hemisphere, times the point's throughput. With `residual`, only the share of the first segment that the
    // falloff leaves out. The points are used up.
    void follow(std::vector<PathPoint>& points, std::uint32_t key, const Residual* residual, std::span<vec3> light);

    // Adds the light straight from the lights, as radiance that leaves the points toward the viewer.
    void add_direct(const std::vector<PathPoint>& points, std::uint32_t bounce, std::uint32_t key,
                    std::span<vec3> light);

  private:
    const Scene& scene_;
    const NextEvent& lights_;
    int max_bounces_;
    std::vector<Ray> rays_;
    std::vector<Hit> hits_;
    RayBatch shadow_rays_;

    void bounce(std::vector<PathPoint>& points, std::uint32_t bounce, std::uint32_t key, const Residual* residual);
};

}  // namespace lab
