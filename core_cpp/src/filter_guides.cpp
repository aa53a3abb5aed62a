#include "lab/filter_guides.h"

#include <algorithm>
#include <cmath>

#include "lab/filter_pixels.h"

namespace lab {
namespace {

// Positions relative to the first surface point: a scene far from the origin keeps its precision.
vec3 centre_of(const GBufferView& gbuffer) {
    const auto hit = std::find_if(gbuffer.depth.begin(), gbuffer.depth.end(), [](float d) { return d > 0; });
    return hit == gbuffer.depth.end() ? vec3(0) : gbuffer.position[hit - gbuffer.depth.begin()];
}

}  // namespace

double per_sigma(double sigma, double unit) {
    return std::isinf(sigma) ? 0.0 : std::min(1.0 / (sigma * unit), 1e30);
}

Planes surface_guides(const GBufferView& gbuffer, const Params& params, double scene_radius) {
    const bool plane = params.filter == Filter::atrous_plane, variance = params.filter == Filter::atrous_variance;
    Planes planes(gbuffer.width, gbuffer.height, plane ? 7 : 6);
    PixelScale normal, position;
    position.offset = centre_of(gbuffer);
    if (!plane) {
        normal.factor = static_cast<float>(per_sigma(params.sigma_normal));
        position.factor = static_cast<float>(per_sigma(params.sigma_position, scene_radius));
        normal.limit = position.limit = guide_limit;
        normal.scale = position.scale = guide_scale;
    }
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < gbuffer.height; ++y) {
        const auto first = static_cast<std::size_t>(y) * gbuffer.width;
        to_planes(gbuffer.normal.subspan(first, gbuffer.width), normal, planes.row(0, y), planes.stride());
        to_planes(gbuffer.position.subspan(first, gbuffer.width), position, planes.row(3, y), planes.stride());
        const float* depth = &gbuffer.depth[first];
        if (plane || variance)
            for (int x = 0; x < gbuffer.width; ++x)
                if (!(depth[x] > 0)) planes.row(3, y)[x] = std::numeric_limits<float>::quiet_NaN();
        if (plane)
            for (int x = 0; x < gbuffer.width; ++x) {
                const double footprint = double{depth[x]} * gbuffer.pixel_angle;
                planes.row(6, y)[x] = static_cast<float>(guide_scale * per_sigma(params.sigma_plane, footprint));
            }
    }
    return planes;
}

}  // namespace lab
