#include "lab/path_walk.h"

#include <algorithm>
#include <numbers>

#include "lab/sampling.h"

namespace lab {

void PathWalk::add_direct(const std::vector<PathPoint>& points, std::uint32_t bounce, std::uint32_t key,
                          std::span<vec3> light) {
    for (const PathPoint& p : points)
        lights_.push(p.at, {p.path, bounce, key}, p.throughput * std::numbers::inv_pi_v<float>, p.slot, shadow_rays_);
    shadow_rays_.gather(scene_, bounce == 0 ? Coherence::coherent : Coherence::incoherent, light);
}

// Moves each path on by one cosine-weighted segment; those that leave the scene or meet black end.
void PathWalk::bounce(std::vector<PathPoint>& points, std::uint32_t bounce, std::uint32_t key,
                      const Residual* residual) {
    const float reach = residual ? residual->reach() : std::numeric_limits<float>::infinity();
    rays_.clear();
    std::size_t alive = 0;
    for (const PathPoint& p : points) {
        const Random4 r = random4(p.path, bounce, Stream::path_direction, key);
        const vec3 direction = sample_cosine(p.at.normal, to_unit(r.x), to_unit(r.y));
        if (glm::dot(direction, p.at.geometric_normal) <= 0) continue;  // into the surface
        rays_.push_back({scene_.off_surface(p.at.position, p.at.geometric_normal), direction, reach});
        points[alive++] = p;
    }
    points.resize(alive);
    hits_.resize(alive);
    scene_.rays().intersect(rays_, hits_, Coherence::incoherent);
    std::size_t met = 0;
    for (std::size_t i = 0; i < alive; ++i) {
        if (!hits_[i].found()) continue;
        Surface surface = scene_.surface(hits_[i]);
        PathPoint next = points[i];
        next.throughput *= surface.albedo;
        if (residual) {
            const vec3 to = surface.position - points[i].at.position;
            next.throughput *= residual->share(glm::dot(to, to));
        }
        if (!(next.throughput.x > 0 || next.throughput.y > 0 || next.throughput.z > 0)) continue;
        surface.turn_toward(rays_[i].direction);
        next.at = {surface.position, surface.normal, surface.geometric_normal};
        points[met++] = next;
    }
    points.resize(met);
}

void PathWalk::follow(std::vector<PathPoint>& points, std::uint32_t key, const Residual* residual,
                      std::span<vec3> light) {
    for (int b = 1; b <= max_bounces_ && !points.empty(); ++b) {
        bounce(points, static_cast<std::uint32_t>(b), key, b == 1 ? residual : nullptr);
        add_direct(points, static_cast<std::uint32_t>(b), key, light);
    }
}

}  // namespace lab
