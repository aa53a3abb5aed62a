#include "lab/composite.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lab {
namespace {

// Mean irradiance over a window that holds every interleaving tile with the same weight: n + 1 pixels a side,
// the outer ones counted half, so a flat, evenly lit receiver gets back the sum over all lights exactly.
// Pixels of another surface (normal, depth) stay out of it.
vec3 recombine(const GBufferView& g, std::span<const vec3> irradiance, int x, int y, int n) {
    const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
    const vec3 normal = g.normal[p], position = g.position[p];
    const float footprint = g.depth[p] * g.pixel_angle * static_cast<float>(n);
    vec3 sum(0.0f);
    float total = 0.0f;
    for (int dy = -n / 2; dy <= n / 2; ++dy)
        for (int dx = -n / 2; dx <= n / 2; ++dx) {
            // At the border the window folds back by whole tiles, which keeps each tile's share.
            int qx = x + dx, qy = y + dy;
            if (qx < 0) qx += n;
            if (qx >= g.width) qx -= n;
            if (qy < 0) qy += n;
            if (qy >= g.height) qy -= n;
            if (qx < 0 || qy < 0) continue;
            const std::size_t q = static_cast<std::size_t>(qy) * g.width + qx;
            if (g.depth[q] <= 0) continue;
            const float aligned = glm::dot(normal, g.normal[q]);
            const float off_plane = std::abs(glm::dot(normal, g.position[q] - position));
            if (aligned < 0.8f || off_plane > footprint) continue;
            const float weight = (2 * std::abs(dx) == n ? 0.5f : 1.0f) * (2 * std::abs(dy) == n ? 0.5f : 1.0f);
            sum += weight * irradiance[q];
            total += weight;
        }
    return total > 0 ? sum / total : irradiance[p];
}

}  // namespace

ImageData composite(const GBufferView& g, const CompositeInput& in, const Params& params) {
    const std::size_t pixels = g.pixels();
    const int channels = in.channels;
    const bool shadows = params.shadow_samples > 0;
    ImageData out;
    for (auto* plane : {&out.colour, &out.direct, &out.unshadowed, &out.indirect}) plane->assign(pixels, vec3(0.0f));
    out.shadow_ratio.assign(pixels * channels, 0.0f);
#pragma omp parallel for schedule(static)
    for (int y = 0; y < g.height; ++y)
        for (int x = 0; x < g.width; ++x) {
            const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
            if (g.depth[p] <= 0) {
                out.colour[p] = in.background;
                continue;
            }
            vec3 ratio(1.0f);
            for (int c = 0; c < channels; ++c) {
                const std::size_t pc = p * channels + c;
                // Where no sample near or far says anything, no light is shown: a hard 1 would leak.
                const float r = !shadows ? 1.0f : in.weight[pc] > 0 ? in.shadowed[pc] / in.weight[pc] : 0.0f;
                out.shadow_ratio[pc] = r;
                if (channels == 1)
                    ratio = vec3(r);
                else
                    ratio[c] = r;
            }
            const vec3 reflectance = g.albedo[p] * std::numbers::inv_pi_v<float>;
            out.unshadowed[p] =
                params.interleave > 1 ? recombine(g, in.irradiance, x, y, params.interleave) : in.irradiance[p];
            out.indirect[p] = out.unshadowed[p] * ratio * reflectance;
            out.direct[p] = g.emission[p] + (in.direct[p] + in.area[p]) * reflectance;
            out.colour[p] = out.direct[p] + out.indirect[p];
        }
    return out;
}

}  // namespace lab
