#include "lab/limit_rays.h"

#include <algorithm>
#include <mutex>
#include <numeric>

#include "lab/render_gbuffer.h"
#include "lab/shadow_block.h"
#include "lab/trace_shadow_rays.h"
#include "lab/trace_vpls.h"

namespace lab {
namespace {

using Prepared = RayTracer::Prepared;

RayLimit measure(const Scene& scene, const std::vector<Prepared>& packets, RayTracer::Query query, int repetitions) {
    RayLimit limit{0, 0};
    for (const Prepared& p : packets) limit.rays += p.count;
    std::vector<double> seconds(std::max(1, repetitions));
    for (double& s : seconds) s = scene.rays().seconds(packets, query);
    const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
    std::nth_element(seconds.begin(), middle, seconds.end());
    limit.seconds = *middle;
    return limit;
}

}  // namespace

RayLimit limit_vpl_rays(const Scene& scene, const Params& params, int repetitions) {
    std::mutex mutex;
    std::vector<Prepared> packets;
    trace_vpls(scene, params, [&](std::span<const Ray> rays) {
        const std::lock_guard lock(mutex);
        for (std::size_t first = 0; first < rays.size(); first += RayPacket::size) {
            Prepared p;
            p.count = static_cast<int>(std::min<std::size_t>(RayPacket::size, rays.size() - first));
            p.coherence = Coherence::incoherent;
            for (int i = 0; i < p.count; ++i) {
                const Ray& ray = rays[first + i];
                p.packet.set(i, ray.origin, ray.direction, ray.length);
            }
            p.packet.pad(p.count);
            packets.push_back(p);
        }
    });
    return measure(scene, packets, RayTracer::Query::nearest, repetitions);
}

RayLimit limit_gbuffer_rays(const Scene& scene, const Camera& camera, int width, int height, int repetitions) {
    const PixelBlocks blocks(camera, width, height);
    std::vector<Prepared> packets;
    for (int i = 0; i < blocks.tiles(); ++i) {
        const PixelBlocks::Tile tile = blocks.tile(i);
        for (int row = tile.top; row < tile.bottom; ++row)
            for (int column = tile.left; column < tile.right; ++column) {
                Prepared& p = packets.emplace_back();
                p.count = blocks.rays(column, row, p.packet);
                p.coherence = Coherence::coherent;
            }
    }
    return measure(scene, packets, RayTracer::Query::nearest, repetitions);
}

RayLimit limit_shadow_rays(const Scene& scene, const HierarchyView& hierarchy, const GBufferView& gbuffer,
                           const LightingView& lighting, const Params& params, int repetitions) {
    std::vector<std::vector<Prepared>> of_block(shadow_blocks(gbuffer, params).size());
    trace_shadow_rays(scene, hierarchy, gbuffer, lighting, params,
                      [&](std::size_t block, RayPacket& packet, int count, Coherence coherence) {
                          of_block[block].push_back({packet, count, coherence});
                          return 0u;
                      });
    std::vector<Prepared> packets;
    for (std::vector<Prepared>& p : of_block) {
        packets.insert(packets.end(), p.begin(), p.end());
        p = {};
    }
    return measure(scene, packets, RayTracer::Query::any, repetitions);
}

}  // namespace lab
