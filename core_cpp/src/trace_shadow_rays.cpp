#include "lab/trace_shadow_rays.h"

#include <algorithm>

#include "lab/shadow_block.h"
#include "lab/trace_paths.h"

namespace lab {
namespace {

// Mean irradiance of a few short paths a pixel.
std::vector<vec3> compensate(const Scene& scene, const GBufferView& g, const Params& params) {
    const auto count = static_cast<std::uint32_t>(params.compensation_samples);
    const SampleSums sums = trace_compensation(scene, g, {params.frame * count, count}, params);
    std::vector<vec3> mean(g.pixels());
    for (std::size_t p = 0; p < mean.size(); ++p) mean[p] = vec3(sums.sum[p] / static_cast<double>(count));
    return mean;
}

}  // namespace

std::size_t shadow_blocks(const GBufferView& g, const Params& params) {
    const int side = ShadowBlock::side(params.shadow_samples);
    const int columns = (g.width + side - 1) / side, rows = (g.height + side - 1) / side;
    return static_cast<std::size_t>(columns) * rows;
}

ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& h, const GBufferView& g,
                             const LightingView& lighting, const Params& params, const TracePacket& trace) {
    const std::size_t pixels = g.pixels(), slots = pixels * params.shadow_samples;
    ShadowData out;
    out.channels = params.shadow_estimator == ShadowEstimator::ratio_rgb ? 3 : 1;
    out.point.resize(slots);
    out.member.resize(slots);
    out.omega.resize(slots);
    out.visible.resize(slots);
    out.shadowed.resize(pixels * out.channels);
    out.weight.resize(pixels * out.channels);
    out.direct.resize(pixels);
    out.area.resize(pixels);
    const Sampler sampler(h, g, lighting, params, scene);
    const RayOrder order(scene);
    const int side = ShadowBlock::side(params.shadow_samples);
    const int columns = (g.width + side - 1) / side, blocks = static_cast<int>(shadow_blocks(g, params));
#pragma omp parallel
    {
        // All is drawn before the first ray is traced: lights and tree do not fit the caches together.
        if (params.shadow_samples > 0) {
            constexpr std::int64_t run = 1024;
#pragma omp for schedule(dynamic)
            for (std::int64_t first = 0; first < static_cast<std::int64_t>(pixels); first += run)
                sampler.draw(first, std::min(run, static_cast<std::int64_t>(pixels) - first), out);
        }
        ShadowBlock block(scene, sampler, order, trace, out);
#pragma omp for schedule(dynamic)
        for (int b = 0; b < blocks; ++b) block.shade(b % columns * side, b / columns * side, b);
    }
    return out;
}

ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& h, const GBufferView& g,
                             const LightingView& lighting, const Params& params) {
    ShadowData out = trace_shadow_rays(scene, h, g, lighting, params,
                                       [&](std::size_t, RayPacket& packet, int count, Coherence coherence) {
                                           return scene.rays().visible(packet, count, coherence);
                                       });
    if (params.compensation == Compensation::path) out.left_out = compensate(scene, g, params);
    return out;
}

}  // namespace lab
