#include "lab/composite.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/luminance.h"

namespace lab {
namespace {

// The filtered shadow ratio of pixel (x, y), channel c. Where no sample says anything the pixels around it do: a hard 1
// would leak light. Where they know nothing either, no light is shown.
float ratio_at(const GBufferView& g, const CompositeInput& in, int x, int y, int c) {
    for (const int reach : {0, 1, 2, 4}) {
        float shadowed = 0.0f, weight = 0.0f;
        for (int qy = std::max(0, y - reach); qy <= std::min(g.height - 1, y + reach); ++qy)
            for (int qx = std::max(0, x - reach); qx <= std::min(g.width - 1, x + reach); ++qx) {
                const std::size_t q = (static_cast<std::size_t>(qy) * g.width + qx) * in.channels + c;
                shadowed += in.shadowed[q];
                weight += in.weight[q];
            }
        if (weight > 0) return shadowed / weight;
    }
    return 0.0f;
}

struct Irradiance {
    vec3 unshadowed, shadowed;
};

// The mean of what the interleaving tiles see, shadowed by their own ratios, over a window that holds every tile with
// the same weight: n + 1 pixels a side, the outer ones counted half, so a flat, evenly lit receiver gets back the sum
// over all lights exactly. Pixels of another surface (normal, depth) stay out of it.
Irradiance recombine(const GBufferView& g, std::span<const vec3> irradiance, const std::vector<vec3>& ratio, int x,
                     int y, int n) {
    const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
    const vec3 normal = g.normal[p], position = g.position[p];
    const float footprint = g.depth[p] * g.pixel_angle * static_cast<float>(n);
    Irradiance sum{vec3(0.0f), vec3(0.0f)};
    float total = 0.0f;
    for (int dy = -n / 2; dy <= n / 2; ++dy)
        for (int dx = -n / 2; dx <= n / 2; ++dx) {
            // At the border the window folds back by whole tiles, which keeps each tile's share.
            int qx = x + dx, qy = y + dy;
            if (qx < 0) qx += n;
            if (qx >= g.width) qx -= n;
            if (qy < 0) qy += n;
            if (qy >= g.height) qy -= n;
            if (qx < 0 || qy < 0 || qx >= g.width || qy >= g.height) continue;
            const std::size_t q = static_cast<std::size_t>(qy) * g.width + qx;
            if (g.depth[q] <= 0) continue;
            const float aligned = glm::dot(normal, g.normal[q]);
            const float off_plane = std::abs(glm::dot(normal, g.position[q] - position));
            if (aligned < 0.8f || off_plane > footprint) continue;
            const float weight = (2 * std::abs(dx) == n ? 0.5f : 1.0f) * (2 * std::abs(dy) == n ? 0.5f : 1.0f);
            sum.unshadowed += weight * irradiance[q];
            sum.shadowed += weight * irradiance[q] * ratio[q];
            total += weight;
        }
    if (total <= 0) return {irradiance[p], irradiance[p] * ratio[p]};
    return {sum.unshadowed / total, sum.shadowed / total};
}

// The ratio of the recombined light, so that unshadowed * ratio stays what is shown; `own` where there is no light.
vec3 recombined_ratio(const Irradiance& light, const vec3& own, int channels) {
    vec3 ratio = own;
    if (channels == 1) {
        const float whole = luminance(light.unshadowed);
        if (whole > 0) ratio = vec3(luminance(light.shadowed) / whole);
    } else {
        for (int c = 0; c < 3; ++c)
            if (light.unshadowed[c] > 0) ratio[c] = light.shadowed[c] / light.unshadowed[c];
    }
    return ratio;
}

}  // namespace

ImageData composite(const GBufferView& g, const CompositeInput& in, const Params& params) {
    const std::size_t pixels = g.pixels();
    const int channels = in.channels;
    ImageData out;
    for (auto* plane : {&out.colour, &out.direct, &out.unshadowed, &out.indirect}) plane->assign(pixels, vec3(0.0f));
    out.shadow_ratio.assign(pixels * channels, 0.0f);
    std::vector<vec3> own_ratio(pixels, vec3(1.0f));
    if (params.shadow_samples > 0)
#pragma omp parallel for schedule(dynamic, 8)
        for (int y = 0; y < g.height; ++y)
            for (int x = 0; x < g.width; ++x)
                for (int c = 0; c < 3; ++c) {
                    vec3& ratio = own_ratio[static_cast<std::size_t>(y) * g.width + x];
                    ratio[c] = c < channels ? ratio_at(g, in, x, y, c) : ratio[0];
                }
#pragma omp parallel for schedule(dynamic, 8)
    for (int y = 0; y < g.height; ++y)
        for (int x = 0; x < g.width; ++x) {
            const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
            if (g.depth[p] <= 0) {
                out.colour[p] = in.background;
                continue;
            }
            vec3 ratio = own_ratio[p];
            out.unshadowed[p] = in.irradiance[p];
            if (params.interleave > 1) {
                const Irradiance light = recombine(g, in.irradiance, own_ratio, x, y, params.interleave);
                out.unshadowed[p] = light.unshadowed;
                ratio = recombined_ratio(light, ratio, channels);
            }
            for (int c = 0; c < channels; ++c) out.shadow_ratio[p * channels + c] = ratio[c];
            const vec3 reflectance = g.albedo[p] * std::numbers::inv_pi_v<float>;
            out.indirect[p] = out.unshadowed[p] * ratio * reflectance;
            if (!in.left_out.empty()) out.indirect[p] += in.left_out[p] * reflectance;
            out.direct[p] = g.emission[p] + (in.direct[p] + in.area[p]) * reflectance;
            out.colour[p] = out.direct[p] + out.indirect[p];
        }
    return out;
}

}  // namespace lab
