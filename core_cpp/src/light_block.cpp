#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/light_block.cpp"
#include <hwy/foreach_target.h>

#include "lab/light_block.h"
//
#include "lab/cull_lanes.h"
#include "lab/light_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// Bounds of several groups, from theirs.
GroupBounds bounds_of(const PixelGroup* begin, const PixelGroup* end) {
    GroupBounds all{vec3(0.0f), vec3(0.0f), vec3(0.0f), 0.0f, std::numeric_limits<float>::lowest()};
    vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const PixelGroup* g = begin; g != end; ++g) {
        low = glm::min(low, g->bounds.centre - g->bounds.extent);
        high = glm::max(high, g->bounds.centre + g->bounds.extent);
        all.normal += g->bounds.normal;
    }
    all.centre = 0.5f * (low + high);
    all.extent = glm::max(high - all.centre, all.centre - low);
    const float length = glm::length(all.normal);
    if (length > 1e-3f) all.normal /= length;
    for (const PixelGroup* g = begin; g != end; ++g) {
        const GroupBounds& b = g->bounds;
        const float turn = glm::length(b.normal - all.normal);
        all.spread = larger(all.spread, b.spread + turn);
        all.slab = larger(all.slab, glm::dot(all.normal, all.centre - b.centre) + b.slab + turn * b.radius());
    }
    return all;
}

// The lights of each level that reach a group, counted pixel by pixel.
void count_used(const LightFrame& frame, const ReadyLight* lights, const std::uint32_t* list, const PixelGroup& g,
                const LightBatch& batch, LightingData& out) {
    const std::size_t pixels = frame.gbuffer.pixels();
    for (std::size_t i = 0; i < batch.size; ++i)
        for (int lane = 0; lane < g.count; ++lane)
            out.lights_used[lights[list[i]].level * pixels + g.pixel[lane]] +=
                batch.target[i * group_lanes + lane] > 0.0f;
}

void count_overdraw(const LightFrame& frame, const BlockScratch& s, const PixelGroup& g, int tile, LightingData& out) {
    const std::size_t pixels = frame.gbuffer.pixels();
    const LightColumns& lights = s.dealt[tile];
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const ReadyLight& light = s.lights[lights.slot(i)];
        const vec3 gap = glm::abs(light.position - g.bounds.centre) - g.bounds.extent;
        if (gap.x > light.outer * 1.0001f || gap.y > light.outer * 1.0001f || gap.z > light.outer * 1.0001f) continue;
        for (int lane = 0; lane < g.count; ++lane)
            out.overdraw[light.level * pixels + g.pixel[lane]] +=
                std::abs(g.px[lane] - light.position.x) <= light.outer &&
                std::abs(g.py[lane] - light.position.y) <= light.outer &&
                std::abs(g.pz[lane] - light.position.z) <= light.outer;
    }
}

template <bool soft, bool clamped>
void light_pixels(const LightFrame& frame, const PixelGroup& g, const std::uint32_t* list, std::size_t count,
                  BlockScratch& s, LightingData& out) {
    const ReadyLight* lights = s.lights.data();
    const bool counts = !out.lights_used.empty();
    const auto first_to_pick =
        std::partition_point(list, list + (frame.first_pick > 0 ? count : 0),
                             [&](std::uint32_t i) { return lights[i].index < frame.first_pick; });
    GroupSums sums;
    light_group<soft, clamped>(lights, list, count, first_to_pick - list, g, frame.settings.clamp2, frame.picks, counts,
                               sums, s.picks, s.batch, [&](std::size_t first) {
                                   if (counts) count_used(frame, lights, list + first, g, s.batch, out);
                               });
    s.visited += count * group_lanes;
    const std::size_t samples = frame.picks.samples;
    for (int i = 0; i < g.count; ++i) {
        const std::size_t p = g.pixel[i];
        out.irradiance[p] = {sums.red[i], sums.green[i], sums.blue[i]};
        out.weight_sum[p] = samples > 0 ? s.picks.weight_sum(i) : 0.0f;
        for (std::size_t k = 0; k < samples; ++k) {
            out.light[p * samples + k] = s.picks.light[k * group_lanes + i];
            out.target_weight[p * samples + k] = s.picks.weight[k * group_lanes + i];
        }
    }
}

void light_block(const LightFrame& frame, int block, BlockScratch& s, LightingData& out) {
    load_block(frame, block, s, out);
    if (s.patches.empty()) return;
    const std::size_t groups = s.patches.back().end;
    for (std::size_t i = 0; i < groups; ++i) s.groups[i].bounds = bounds_of(s.groups[i]);
    for (const Patch& patch : s.patches) {
        regroup(frame, patch, s);
        for (const std::size_t i : s.regrouped) s.groups[i].bounds = bounds_of(s.groups[i]);
    }
    find_lights(frame, s);
    const float no_horizon = frame.settings.receiver == Receiver::soft ? 1e30f : 0.0f;
    const auto cull_into = [&](GroupBounds bounds, const LightColumns& lights) {
        if (s.kept.size() < lights.size() + group_lanes) s.kept.resize(lights.size() + group_lanes);
        bounds.slab += no_horizon;
        return cull(bounds, lights, s.kept.data());
    };
    with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
        for (const Patch& patch : s.patches) {
            PixelGroup* const begin = s.groups.data() + patch.begin;
            PixelGroup* const end = s.groups.data() + patch.end;
            const LightColumns& dealt = s.dealt[patch.tile];
            const std::size_t near = cull_into(bounds_of(begin, end), dealt);
            s.near.assign(dealt, s.kept.data(), near);
            for (PixelGroup* g = begin; g != end; ++g) {
                if (!out.overdraw.empty()) count_overdraw(frame, s, *g, patch.tile, out);
                const std::size_t count = cull_into(g->bounds, s.near);
                for (std::size_t i = 0; i < count; ++i) s.kept[i] = s.near.slot(s.kept[i]);
                light_pixels<soft, clamped>(frame, *g, s.kept.data(), count, s, out);
            }
        }
    });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(light_block);

void light_block(const LightFrame& frame, int block, BlockScratch& scratch, LightingData& out) {
    HWY_DYNAMIC_DISPATCH(light_block)(frame, block, scratch, out);
}

}  // namespace lab
#endif
