#include "lab/render_gbuffer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lab {

GBufferData render_gbuffer(const Scene& scene, const Camera& camera, int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    GBufferData g;
    for (auto* plane : {&g.position, &g.normal, &g.geometric_normal, &g.albedo, &g.emission})
        plane->assign(pixels, vec3(0.0f));
    g.depth.assign(pixels, 0.0f);

    // In double: a camera far from the origin keeps its direction.
    const glm::dvec3 forward = glm::normalize(glm::dvec3(camera.target) - glm::dvec3(camera.eye));
    const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(camera.up)));
    const glm::dvec3 up = glm::cross(right, forward);
    const double half = std::tan(0.5 * static_cast<double>(camera.fov_y)), step = 2 * half / height;
    g.pixel_angle = static_cast<float>(step);

    // Packets of 4 x 4 pixels: neighbours in both directions stay together in the tree.
    constexpr int block = 4;
    const int blocks_x = (width + block - 1) / block, blocks_y = (height + block - 1) / block;
#pragma omp parallel for schedule(dynamic)
    for (int by = 0; by < blocks_y; ++by)
        for (int bx = 0; bx < blocks_x; ++bx) {
            std::array<Ray, block * block> rays;
            std::array<Hit, block * block> hits;
            std::array<std::size_t, block * block> pixel;
            std::size_t count = 0;
            for (int y = by * block; y < std::min(height, (by + 1) * block); ++y)
                for (int x = bx * block; x < std::min(width, (bx + 1) * block); ++x) {
                    const double sx = (x + 0.5 - 0.5 * width) * step, sy = (0.5 * height - y - 0.5) * step;
                    const vec3 direction(glm::normalize(forward + sx * right + sy * up));
                    pixel[count] = static_cast<std::size_t>(y) * width + x;
                    rays[count++] = {camera.eye, direction, std::numeric_limits<float>::infinity()};
                }
            scene.rays().intersect(std::span(rays.data(), count), std::span(hits.data(), count), Coherence::coherent);
            for (std::size_t i = 0; i < count; ++i) {
                if (!hits[i].found()) continue;
                const vec3 view = rays[i].direction;
                const vec3 ng = scene.triangle_normal(hits[i].triangle);
                const float slope = std::max(0.05f, std::abs(glm::dot(ng, view)));
                Surface s = scene.surface(hits[i], hits[i].t * g.pixel_angle / std::sqrt(slope));
                const bool front = s.turn_toward(view);
                const std::size_t p = pixel[i];
                g.position[p] = s.position;
                g.geometric_normal[p] = s.geometric_normal;
                g.normal[p] = s.normal;
                g.albedo[p] = s.albedo;
                g.emission[p] = front || s.emits_back ? s.emission : vec3(0.0f);
                g.depth[p] = hits[i].t * static_cast<float>(glm::dot(glm::dvec3(view), forward));
            }
        }
    return g;
}

}  // namespace lab
