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

// Where a light counts as overdraw.
struct LightCube {
    vec3 centre;
    float half_edge;
    int level;
};

// Counts of a group's pixels, gathered level by level before they go to the pictures.
class LevelCounts {
  public:
    LevelCounts(const PixelGroup& group, std::size_t pixels, Buffer<std::uint32_t>& out)
        : group_(group), pixels_(pixels), out_(out) {}
    ~LevelCounts() { flush(); }
    LevelCounts(const LevelCounts&) = delete;
    LevelCounts& operator=(const LevelCounts&) = delete;

    // The lanes' counts of a level, until another is asked for.
    std::uint32_t* of(int level) {
        if (level != level_) flush();
        level_ = level;
        return count_;
    }

    void add_to_all(int level) {
        of(level);
        ++all_;
    }

  private:
    const PixelGroup& group_;
    std::size_t pixels_;
    Buffer<std::uint32_t>& out_;
    int level_ = -1;
    std::uint32_t count_[group_lanes] = {}, all_ = 0;

    void flush() {
        if (level_ < 0) return;
        for (int lane = 0; lane < group_.count; ++lane)
            out_[level_ * pixels_ + group_.pixel[lane]] += count_[lane] + all_;
        std::fill_n(count_, group_lanes, 0u);
        all_ = 0;
    }
};

// The lights of each level that reach a group.
void count_used(const LightFrame& frame, const ReadyLight* lights, const std::uint32_t* list, const PixelGroup& g,
                const LightBatch& batch, LightingData& out) {
    LevelCounts counts(g, frame.gbuffer.pixels(), out.lights_used);
    for (std::size_t i = 0; i < batch.size; ++i) {
        std::uint32_t* count = counts.of(lights[list[i]].level);
        const float* target = batch.target + i * group_lanes;
#pragma omp simd
        for (int lane = 0; lane < group_lanes; ++lane) count[lane] += target[lane] > 0.0f ? 1u : 0u;
    }
}

// A light's cube, as far as a group's pixels are concerned: with a little to spare for rounding, most lights need no
// look at single pixels.
enum class Cover { none, some, all };

Cover cover(const LightCube& cube, const GroupBounds& bounds) {
    const vec3 apart = glm::abs(cube.centre - bounds.centre);
    const vec3 nearest = apart - bounds.extent, farthest = apart + bounds.extent;
    const float more = cube.half_edge * 1.0001f, less = cube.half_edge * 0.9999f;
    if (nearest.x > more || nearest.y > more || nearest.z > more) return Cover::none;
    return farthest.x < less && farthest.y < less && farthest.z < less ? Cover::all : Cover::some;
}

// The cubes, of the lights dealt to a tile, that may hold pixels of a patch.
void find_cubes(const BlockScratch& s, const LightColumns& dealt, const GroupBounds& patch,
                std::vector<LightCube>& cubes) {
    cubes.clear();
    for (std::size_t i = 0; i < dealt.size(); ++i) {
        const ReadyLight& light = s.lights[dealt.slot(i)];
        const LightCube cube{light.position, light.outer, static_cast<int>(light.level)};
        if (cover(cube, patch) != Cover::none) cubes.push_back(cube);
    }
}

void count_overdraw(const LightFrame& frame, const std::vector<LightCube>& cubes, const PixelGroup& g,
                    LightingData& out) {
    LevelCounts counts(g, frame.gbuffer.pixels(), out.overdraw);
    for (const LightCube& cube : cubes) {
        const Cover covers = cover(cube, g.bounds);
        if (covers == Cover::none) continue;
        if (covers == Cover::all) {
            counts.add_to_all(cube.level);
            continue;
        }
        std::uint32_t* count = counts.of(cube.level);
        const float x = cube.centre.x, y = cube.centre.y, z = cube.centre.z, half_edge = cube.half_edge;
#pragma omp simd
        for (int lane = 0; lane < group_lanes; ++lane) {
            const bool inside = magnitude(g.px[lane] - x) <= half_edge && magnitude(g.py[lane] - y) <= half_edge &&
                                magnitude(g.pz[lane] - z) <= half_edge;
            count[lane] += inside ? 1u : 0u;
        }
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
    const bool counts = !out.overdraw.empty();
    std::vector<LightCube> cubes;
    with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
        for (const Patch& patch : s.patches) {
            PixelGroup* const begin = s.groups.data() + patch.begin;
            PixelGroup* const end = s.groups.data() + patch.end;
            const LightColumns& dealt = s.dealt[patch.tile];
            const GroupBounds bounds = bounds_of(begin, end);
            const std::size_t near = cull_into(bounds, dealt);
            s.near.assign(dealt, s.kept.data(), near);
            if (counts) find_cubes(s, dealt, bounds, cubes);
            for (PixelGroup* g = begin; g != end; ++g) {
                if (counts) count_overdraw(frame, cubes, *g, out);
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
