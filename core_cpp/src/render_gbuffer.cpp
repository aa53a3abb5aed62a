#include "lab/render_gbuffer.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lab {

GBufferData render_gbuffer(const Scene& scene, const Camera& camera, int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    GBufferData g;
    for (auto* plane : {&g.position, &g.normal, &g.geometric_normal, &g.albedo, &g.emission})
        plane->assign(pixels, vec3(0.0f));
    g.depth.assign(pixels, 0.0f);

    const CameraRays camera_rays(camera, width, height);
    g.pixel_angle = camera_rays.pixel_angle();

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
                    pixel[count] = static_cast<std::size_t>(y) * width + x;
                    rays[count++] = camera_rays.through(x + 0.5, y + 0.5);
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
                g.depth[p] = camera_rays.depth(rays[i], hits[i].t);
            }
        }
    return g;
}

}  // namespace lab
