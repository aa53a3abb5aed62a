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

ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& h, const GBufferView& g,
                             const LightingView& lighting, const Params& params, const TracePacket& trace) {
    const std::size_t pixels = g.pixels(), slots = pixels * params.shadow_samples;
    ShadowData out;
    out.channels = params.shadow_estimator == ShadowEstimator::ratio_rgb ? 3 : 1;
    out.point.reserve(slots + 1);  // packets are filled from rows of four numbers
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
    const std::vector<PixelSquare> squares = shadow_blocks(g, params);
    const auto blocks = static_cast<std::int64_t>(squares.size());
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
        for (std::int64_t b = 0; b < blocks; ++b) block.shade(squares[b], b);
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
