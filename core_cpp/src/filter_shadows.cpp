// LY19 3.3: a few shadow rays a pixel are noisy; an edge-stopping filter takes the mean over like neighbours.
// Numerator (S) and denominator (D) of the shadow ratio are filtered with the same weights and divided
// afterwards. The area lights' irradiance is treated alike, as A over a denominator that is 1 on surfaces and
// 0 on background, so that the background does not darken silhouettes.
#include "lab/filter_shadows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "lab/filter_guides.h"
#include "lab/filter_pass.h"
#include "lab/filter_pixels.h"
#include "lab/filter_variance.h"

namespace lab {

namespace {

// Numerators and denominators (as many, or one).
struct Signal {
    Planes planes;  // numerators first
    int numerators;
    double mean_area = 0;  // 0: a shadow ratio; otherwise area light, relative to this mean luminance
};

SpatialKernel gaussian(int radius, double sigma) {
    std::vector<double> weight;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += weight.emplace_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    SpatialKernel kernel;
    for (const double w : weight) kernel.weight.push_back(static_cast<float>(w / sum));
    return kernel;
}

// The filters with a fixed tolerance, all passes: each reads what the one before has written, and its guiding value.
void run_passes(Signal& signal, Planes& surfaces, const Params& params) {
    const int width = surfaces.width(), height = surfaces.height();
    const ValueScale scale{signal.numerators, static_cast<float>(signal.mean_area),
                           static_cast<float>(per_sigma(params.sigma_shadow))};
    const auto per_normal = static_cast<float>(std::min(guide_scale * per_sigma(params.sigma_normal), 1e18));
    const SpatialKernel wide = gaussian(8, 4.0), spline{{1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f}};
    Planes value(width, height, 1), out(width, height, signal.planes.count());
    const auto for_lines = [&](const auto& work) {
#pragma omp parallel for schedule(dynamic, 8) if (out.worth_threads())
        for (int y = 0; y < height; ++y) work(y);
    };
    for (const int step : atrous_steps) {
        for_lines([&](int y) { take_values(signal.planes, scale, y, 0, width, value); });
        for (Planes* planes : {&signal.planes, &value, &surfaces})
            planes->reflect_sides(step, params.filter == Filter::bilateral ? wide.radius() : 2);
        const FilterPass pass{signal.planes, value, surfaces, out};
        if (params.filter == Filter::atrous)
            for_strips(out, step, [&](const Strip& strip, PairRows& pairs) { atrous_strip(pass, strip, pairs); });
        else if (params.filter == Filter::atrous_plane)
            for_lines([&](int y) { plane_line(pass, spline, step, per_normal, y); });
        else
            for_lines([&](int y) { bilateral_line(pass, wide, y); });
        std::swap(signal.planes, out);
        if (params.filter == Filter::bilateral) return;
    }
}

void run(Signal& signal, Planes& surfaces, const Params& params) {
    if (params.filter != Filter::atrous_variance) return run_passes(signal, surfaces, params);
    const float scale = signal.mean_area > 0 ? static_cast<float>(signal.mean_area) : 1.0f;
    filter_by_variance(signal.planes, signal.numerators, scale, std::min(params.sigma_deviation, 1e9f), surfaces);
}

// Room for a signal, and for what the filter keeps beside it.
Planes signal_planes(const GBufferView& gbuffer, int signals, const Params& params) {
    return {gbuffer.width, gbuffer.height, signals + (params.filter == Filter::atrous_variance ? variance_planes : 0)};
}

std::span<const vec3> line_of(std::span<const vec3> pixels, const Planes& planes, int y) {
    return pixels.subspan(static_cast<std::size_t>(y) * planes.width(), planes.width());
}

// Mean luminance over surface pixels, summed in one order whatever the threads. Copies the light on the way: mostly
// there is none, and nothing more to do.
double mean_luminance(const GBufferView& gbuffer, std::span<const vec3> light, Buffer<vec3>& copy) {
    std::vector<double> sums(gbuffer.height);
    std::vector<int> surfaces(gbuffer.height);
#pragma omp parallel for schedule(static) if (gbuffer.pixels() >= 4096)
    for (int y = 0; y < gbuffer.height; ++y) {
        const auto first = static_cast<std::size_t>(y) * gbuffer.width;
        const float* depth = &gbuffer.depth[first];
        const auto line = light.subspan(first, gbuffer.width);
        sums[y] = luminance_sum(line, depth);
        std::copy(line.begin(), line.end(), copy.data() + first);
        surfaces[y] = static_cast<int>(std::count_if(depth, depth + gbuffer.width, [](float d) { return d > 0; }));
    }
    const auto count = std::accumulate(surfaces.begin(), surfaces.end(), std::int64_t{0});
    return count ? std::accumulate(sums.begin(), sums.end(), 0.0) / static_cast<double>(count) : 0.0;
}

Buffer<vec3> filter_light(const GBufferView& gbuffer, std::span<const vec3> light, const Params& params,
                          Planes& surfaces) {
    Buffer<vec3> filtered(light.size());
    const double mean = mean_luminance(gbuffer, light, filtered);
    if (!(mean > 0)) return filtered;
    Signal signal{signal_planes(gbuffer, 4, params), 3, mean};
    Planes& planes = signal.planes;
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < gbuffer.height; ++y) {
        to_planes(line_of(light, planes, y), {}, planes.row(0, y), planes.stride());
        const float* depth = &gbuffer.depth[static_cast<std::size_t>(y) * gbuffer.width];
        float* surface = planes.row(3, y);
        for (int x = 0; x < gbuffer.width; ++x) surface[x] = depth[x] > 0 ? 1.0f : 0.0f;
        for (int c = 0; c < 3; ++c)
            for (int x = 0; x < gbuffer.width; ++x) planes.row(c, y)[x] *= surface[x];
    }
    run(signal, surfaces, params);
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < gbuffer.height; ++y) {
        const float* depth = &gbuffer.depth[static_cast<std::size_t>(y) * gbuffer.width];
        const float* below = planes.row(3, y);
        for (int c = 0; c < 3; ++c)
            for (int x = 0; x < gbuffer.width; ++x)
                planes.row(c, y)[x] = depth[x] > 0 ? planes.row(c, y)[x] / below[x] : 0.0f;
        to_pixels(planes.row(0, y), planes.stride(),
                  {filtered.data() + static_cast<std::size_t>(y) * gbuffer.width, line_of(light, planes, y).size()});
    }
    return filtered;
}

}  // namespace

ShadowSignal filter_shadows(const GBufferView& gbuffer, const ShadowSignalView& signal, const Params& params,
                            float scene_radius) {
    if (params.filter == Filter::none || gbuffer.pixels() == 0)
        return {{signal.shadowed.begin(), signal.shadowed.end()},
                {signal.weight.begin(), signal.weight.end()},
                {signal.area.begin(), signal.area.end()}};

    Planes surfaces = surface_guides(gbuffer, params, scene_radius);
    const int channels = signal.channels;
    ShadowSignal filtered{Buffer<float>(signal.shadowed.size()), Buffer<float>(signal.weight.size()), {}};
    {
        Signal shadow{signal_planes(gbuffer, 2 * channels, params), channels};
        deal(signal.shadowed, channels, 0, shadow.planes);
        deal(signal.weight, channels, channels, shadow.planes);
        run(shadow, surfaces, params);
        collect(shadow.planes, 0, channels, filtered.shadowed);
        collect(shadow.planes, channels, channels, filtered.weight);
    }
    filtered.area = filter_light(gbuffer, signal.area, params, surfaces);
    return filtered;
}

Buffer<vec3> filter_irradiance(const GBufferView& gbuffer, std::span<const vec3> irradiance, const Params& params,
                               float scene_radius) {
    if (params.filter == Filter::none || gbuffer.pixels() == 0) return {irradiance.begin(), irradiance.end()};
    Planes surfaces = surface_guides(gbuffer, params, scene_radius);
    return filter_light(gbuffer, irradiance, params, surfaces);
}

}  // namespace lab
