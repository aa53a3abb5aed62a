// LY19 3.3: a few shadow rays a pixel are noisy; an edge-stopping filter takes the mean over like neighbours.
// Numerator (S) and denominator (D) of the shadow ratio are filtered with the same weights and divided
// afterwards. The area lights' irradiance is treated alike, as A over a denominator that is 1 on surfaces and
// 0 on background, so that the background does not darken silhouettes.
#include "lab/filter_shadows.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lab/filter_planes.h"
#include "lab/filter_variance.h"
#include "lab/filter_weights.h"

namespace lab {

namespace {

constexpr int max_channels = 6;       // S and D in RGB
constexpr float value_limit = 1e30f;  // a ratio beyond it (S over a vanishing D) counts as this
constexpr vec3 luminance_weights{0.2126f, 0.7152f, 0.0722f};

// One pass after the other, each with a separable spatial kernel.
struct Kernel {
    std::vector<float> weight;  // of taps -radius..radius, sums to 1
    std::vector<int> steps;

    int radius() const { return static_cast<int>(weight.size()) / 2; }
};

Kernel gaussian(int radius, double sigma, std::vector<int> steps) {
    std::vector<double> weight;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += weight.emplace_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    Kernel kernel{{}, std::move(steps)};
    for (const double w : weight) kernel.weight.push_back(static_cast<float>(w / sum));
    return kernel;
}

Kernel kernel_of(Filter filter) {
    if (filter == Filter::bilateral) return gaussian(8, 4.0, {1});
    if (filter == Filter::atrous) return gaussian(2, 1.0, {1, 2, 4, 8, 16});
    return {{1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f}, {1, 2, 4, 8, 16}};  // B3 spline
}

// A guide's factor: 1 / (sigma unit). An infinite sigma drops the guide, a vanishing one stays finite.
double per_sigma(double sigma, double unit = 1.0) {
    return std::isinf(sigma) ? 0.0 : std::min(1.0 / (sigma * unit), 1e30);
}

float guide(double value) {
    return guide_scale * static_cast<float>(std::clamp(value, -double{guide_limit}, double{guide_limit}));
}

// Positions relative to the first surface point: a scene far from the origin keeps its precision.
glm::dvec3 centre_of(const GBufferView& gbuffer) {
    const auto hit = std::find_if(gbuffer.depth.begin(), gbuffer.depth.end(), [](float d) { return d > 0; });
    return hit == gbuffer.depth.end() ? glm::dvec3(0) : glm::dvec3(gbuffer.position[hit - gbuffer.depth.begin()]);
}

// The guides that stay the same in every pass; see JointGuide, PlaneGuide and filter_variance.h.
Planes geometry_of(const GBufferView& gbuffer, const Params& params, double scene_radius) {
    const bool plane = params.filter == Filter::atrous_plane, variance = params.filter == Filter::atrous_variance;
    Planes planes(gbuffer.width, gbuffer.height, plane ? 8 : variance ? variance_guides : 6);
    const auto centre = centre_of(gbuffer);
    const double per_normal = per_sigma(params.sigma_normal);
    const double per_position = per_sigma(params.sigma_position, scene_radius);
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < gbuffer.height; ++y) {
        for (int x = 0; x < gbuffer.width; ++x) {
            const auto pixel = static_cast<std::size_t>(y) * gbuffer.width + x;
            const vec3 normal = gbuffer.normal[pixel];
            const glm::dvec3 position = glm::dvec3(gbuffer.position[pixel]) - centre;
            for (int axis = 0; axis < 3; ++axis) {
                planes.row(axis, y)[x] = plane ? normal[axis] : guide(normal[axis] * per_normal);
                planes.row(3 + axis, y)[x] =
                    plane ? static_cast<float>(position[axis]) : guide(position[axis] * per_position);
            }
            if (variance) planes.row(6, y)[x] = gbuffer.depth[pixel] > 0 ? 0.0f : never;
            if (!plane) continue;
            const double footprint = double{gbuffer.depth[pixel]} * gbuffer.pixel_angle;
            planes.row(6, y)[x] = static_cast<float>(guide_scale * per_sigma(params.sigma_plane, footprint));
            planes.row(7, y)[x] = gbuffer.depth[pixel] > 0 ? 0.0f : never;
        }
    }
    return planes;
}

// Numerators and denominators, and how the two make the value that guides the next pass.
struct Signal {
    Planes planes;  // numerators first
    int numerators;
    double mean_area = 0;  // 0: a shadow ratio; otherwise area light, relative to this mean luminance

    int denominators() const { return planes.count() - numerators; }
};

// Scale-free value of an unbounded luminance: l / (l + mean), from 0 to 1.
float guide_value(const Signal& signal, int y, int x) {
    std::array<float, 3> ratio{};
    for (int i = 0; i < signal.numerators; ++i) {
        const int below = signal.numerators + (signal.denominators() == 1 ? 0 : i);
        const float weight = signal.planes.row(below, y)[x];
        ratio[i] = weight > 0 ? signal.planes.row(i, y)[x] / weight : 0.0f;
    }
    if (signal.numerators == 1) return ratio[0];
    const float luminance = glm::dot(luminance_weights, vec3(ratio[0], ratio[1], ratio[2]));
    return signal.mean_area > 0 ? static_cast<float>(luminance / (luminance + signal.mean_area)) : luminance;
}

void guide_by_value(const Signal& signal, double per_value, Planes& value) {
#pragma omp parallel for schedule(static) if (value.worth_threads())
    for (int y = 0; y < value.height(); ++y)
        for (int x = 0; x < value.width(); ++x)
            value.row(0, y)[x] = guide(std::min(guide_value(signal, y, x), value_limit) * per_value);
}

// One pass of one row. What is summed is the *difference* to the pixel's own value: a constant stays exact.
template <class Guide>
void filter_row(const Planes& in, const Guide& guide, const Kernel& kernel, int step, int y, Planes& out) {
    constexpr int chunk = 256;
    alignas(64) float weight[chunk], sum[chunk], change[max_channels][chunk];
    const int radius = kernel.radius();
    for (int x = 0; x < in.width(); x += chunk) {
        const int count = std::min(chunk, in.width() - x);
        std::fill_n(sum, count, kernel.weight[radius] * kernel.weight[radius]);
        for (int c = 0; c < in.count(); ++c) std::fill_n(change[c], count, 0.0f);
        for (int dy = -radius; dy <= radius; ++dy) {
            const int row = reflected(y + dy * step, step, in.height());
            for (int dx = -radius; dx <= radius; ++dx) {
                if (dx == 0 && dy == 0) continue;
                const int shift = dx * step;
                guide.weigh({x, count, y, row, shift, kernel.weight[dy + radius] * kernel.weight[dx + radius]}, weight);
#pragma omp simd
                for (int i = 0; i < count; ++i) sum[i] += weight[i];
                for (int c = 0; c < in.count(); ++c) {
                    const float *p = in.row(c, y) + x, *q = in.row(c, row) + x + shift;
                    float* difference = change[c];
#pragma omp simd
                    for (int i = 0; i < count; ++i) difference[i] += weight[i] * (q[i] - p[i]);
                }
            }
        }
        for (int c = 0; c < in.count(); ++c) {
            const float* p = in.row(c, y) + x;
            float* filtered = out.row(c, y) + x;
#pragma omp simd
            for (int i = 0; i < count; ++i) filtered[i] = p[i] + change[c][i] / sum[i];
        }
    }
}

// All passes of a filter on one signal.
void run(Signal& signal, Planes& geometry, const Params& params) {
    if (params.filter == Filter::atrous_variance) {
        const float scale = signal.mean_area > 0 ? static_cast<float>(signal.mean_area) : 1.0f;
        const float tolerance = std::min(params.sigma_deviation, 1e9f);
        filter_by_variance(signal.planes, signal.numerators, scale, tolerance, geometry);
        return;
    }
    const Kernel kernel = kernel_of(params.filter);
    const double per_value = per_sigma(params.sigma_shadow);
    const float per_normal = static_cast<float>(std::min(guide_scale * per_sigma(params.sigma_normal), 1e18));
    Planes value(geometry.width(), geometry.height(), 1);
    Planes out = signal.planes;
    for (const int step : kernel.steps) {
        guide_by_value(signal, per_value, value);
        for (Planes* planes : {&signal.planes, &value, &geometry}) planes->reflect_sides(step, kernel.radius());
#pragma omp parallel for schedule(dynamic, 8) if (out.worth_threads())
        for (int y = 0; y < out.height(); ++y) {
            if (params.filter == Filter::atrous_plane)
                filter_row(signal.planes, PlaneGuide{value, geometry, 1.0f / step, per_normal * per_normal}, kernel,
                           step, y, out);
            else
                filter_row(signal.planes, JointGuide{value, geometry}, kernel, step, y, out);
        }
        std::swap(signal.planes, out);
    }
}

void deal(std::span<const float> pixels, int channels, int first, Planes& planes) {
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < planes.height(); ++y)
        for (int c = 0; c < channels; ++c)
            for (int x = 0; x < planes.width(); ++x)
                planes.row(first + c, y)[x] = pixels[(std::size_t(y) * planes.width() + x) * channels + c];
}

void collect(const Planes& planes, int first, int channels, std::vector<float>& pixels) {
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < planes.height(); ++y)
        for (int c = 0; c < channels; ++c)
            for (int x = 0; x < planes.width(); ++x)
                pixels[(std::size_t(y) * planes.width() + x) * channels + c] = planes.row(first + c, y)[x];
}

// Mean luminance over surface pixels, summed in one order whatever the threads.
double mean_luminance(const GBufferView& gbuffer, std::span<const vec3> light) {
    double sum = 0;
    std::size_t surfaces = 0;
    for (std::size_t i = 0; i < gbuffer.pixels(); ++i) {
        if (!(gbuffer.depth[i] > 0)) continue;
        sum += glm::dot(luminance_weights, light[i]);
        ++surfaces;
    }
    return surfaces ? sum / static_cast<double>(surfaces) : 0.0;
}

void filter_light(const GBufferView& gbuffer, const Params& params, Planes& geometry, std::vector<vec3>& light) {
    Signal signal{Planes(gbuffer.width, gbuffer.height, 4), 3, mean_luminance(gbuffer, light)};
    if (!(signal.mean_area > 0)) return;
    for (int y = 0; y < gbuffer.height; ++y) {
        for (int x = 0; x < gbuffer.width; ++x) {
            const auto pixel = static_cast<std::size_t>(y) * gbuffer.width + x;
            const float surface = gbuffer.depth[pixel] > 0 ? 1.0f : 0.0f;
            for (int c = 0; c < 3; ++c) signal.planes.row(c, y)[x] = surface * light[pixel][c];
            signal.planes.row(3, y)[x] = surface;
        }
    }
    run(signal, geometry, params);
    for (int y = 0; y < gbuffer.height; ++y) {
        for (int x = 0; x < gbuffer.width; ++x) {
            const auto pixel = static_cast<std::size_t>(y) * gbuffer.width + x;
            for (int c = 0; c < 3; ++c)
                light[pixel][c] =
                    gbuffer.depth[pixel] > 0 ? signal.planes.row(c, y)[x] / signal.planes.row(3, y)[x] : 0.0f;
        }
    }
}

}  // namespace

ShadowSignal filter_shadows(const GBufferView& gbuffer, const ShadowSignalView& signal, const Params& params,
                            float scene_radius) {
    ShadowSignal filtered{{signal.shadowed.begin(), signal.shadowed.end()},
                          {signal.weight.begin(), signal.weight.end()},
                          {signal.area.begin(), signal.area.end()}};
    if (params.filter == Filter::none || gbuffer.pixels() == 0) return filtered;

    Planes geometry = geometry_of(gbuffer, params, scene_radius);
    const int channels = signal.channels;
    Signal shadow{Planes(gbuffer.width, gbuffer.height, 2 * channels), channels};
    deal(signal.shadowed, channels, 0, shadow.planes);
    deal(signal.weight, channels, channels, shadow.planes);
    run(shadow, geometry, params);
    collect(shadow.planes, 0, channels, filtered.shadowed);
    collect(shadow.planes, channels, channels, filtered.weight);

    filter_light(gbuffer, params, geometry, filtered.area);
    return filtered;
}

std::vector<vec3> filter_irradiance(const GBufferView& gbuffer, std::span<const vec3> irradiance, const Params& params,
                                    float scene_radius) {
    std::vector<vec3> filtered(irradiance.begin(), irradiance.end());
    if (params.filter == Filter::none || gbuffer.pixels() == 0) return filtered;
    Planes geometry = geometry_of(gbuffer, params, scene_radius);
    filter_light(gbuffer, params, geometry, filtered);
    return filtered;
}

}  // namespace lab
