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

// Bounds of several clusters, from theirs.
GroupBounds bounds_of(const Cluster* begin, const Cluster* end) {
    GroupBounds all{vec3(0.0f), vec3(0.0f), vec3(0.0f), 0.0f, std::numeric_limits<float>::lowest()};
    vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const Cluster* c = begin; c != end; ++c) {
        low = glm::min(low, c->bounds.centre - c->bounds.extent);
        high = glm::max(high, c->bounds.centre + c->bounds.extent);
        all.normal += c->bounds.normal;
    }
    all.centre = 0.5f * (low + high);
    all.extent = glm::max(high - all.centre, all.centre - low);
    const float length = glm::length(all.normal);
    if (length > 1e-3f) all.normal /= length;
    for (const Cluster* c = begin; c != end; ++c) {
        const GroupBounds& b = c->bounds;
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
    std::uint8_t tile;
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
        for (int lane = 0; lane < group_lanes; ++lane)
            if (group_.lanes >> lane & 1u) out_[level_ * pixels_ + group_.pixel[lane]] += count_[lane] + all_;
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

// The cubes that may hold pixels of a patch.
void find_cubes(const BlockScratch& s, const GroupBounds& patch, std::vector<LightCube>& cubes) {
    cubes.clear();
    for (std::size_t i = 0; i < s.lights.size(); ++i) {
        const ReadyLight& light = s.lights[i];
        const LightCube cube{light.position, light.outer, static_cast<int>(light.level),
                             s.tile_of.empty() ? every_tile : s.tile_of[i]};
        if (cover(cube, patch) != Cover::none) cubes.push_back(cube);
    }
}

// `bounds`: of the group's cluster.
void count_overdraw(const LightFrame& frame, const std::vector<LightCube>& cubes, const GroupBounds& bounds,
                    const PixelGroup& g, int tile, LightingData& out) {
    LevelCounts counts(g, frame.gbuffer.pixels(), out.overdraw);
    for (const LightCube& cube : cubes) {
        if (cube.tile != tile && cube.tile != every_tile) continue;
        const Cover covers = cover(cube, bounds);
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

// A group's results to the pictures.
void store(const LightFrame& frame, const PixelGroup& g, const GroupSums& sums, const GroupPicks& picks,
           LightingData& out) {
    const std::size_t samples = frame.picks.samples;
    const auto each_lane = [&](const auto& put) {
        for (int i = 0; i < group_lanes; ++i)
            if (g.lanes >> i & 1u) put(static_cast<std::size_t>(g.pixel[i]), i);
    };
    each_lane([&](std::size_t p, int i) {
        out.irradiance[p] = {sums.red[i], sums.green[i], sums.blue[i]};
        out.weight_sum[p] = samples > 0 ? picks.weight_sum(i) : 0.0f;
    });
    const hn::Full128<std::int32_t> four;
    const hn::Full128<float> four_floats;
    std::size_t k = 0;
    for (; k + 4 <= samples; k += 4) {  // four samples of a pixel at once
        std::int32_t light[4 * group_lanes];
        float weight[4 * group_lanes];
        for (int i = 0; i < group_lanes; i += 4) {
            const std::int32_t* l = picks.light.data() + k * group_lanes + i;
            const float* w = picks.weight.data() + k * group_lanes + i;
            hn::StoreInterleaved4(hn::LoadU(four, l), hn::LoadU(four, l + group_lanes),
                                  hn::LoadU(four, l + 2 * group_lanes), hn::LoadU(four, l + 3 * group_lanes), four,
                                  light + 4 * i);
            hn::StoreInterleaved4(hn::LoadU(four_floats, w), hn::LoadU(four_floats, w + group_lanes),
                                  hn::LoadU(four_floats, w + 2 * group_lanes),
                                  hn::LoadU(four_floats, w + 3 * group_lanes), four_floats, weight + 4 * i);
        }
        each_lane([&](std::size_t p, int i) {
            hn::StoreU(hn::LoadU(four, light + 4 * i), four, out.light.data() + p * samples + k);
            hn::StoreU(hn::LoadU(four_floats, weight + 4 * i), four_floats, out.target_weight.data() + p * samples + k);
        });
    }
    for (; k < samples; ++k)
        each_lane([&](std::size_t p, int i) {
            out.light[p * samples + k] = picks.light[k * group_lanes + i];
            out.target_weight[p * samples + k] = picks.weight[k * group_lanes + i];
        });
}

HWY_INLINE void fetch_lines(const void* begin, std::size_t bytes) {
    for (std::size_t at = 0; at < bytes; at += 64) __builtin_prefetch(static_cast<const char*>(begin) + at, 1);
}

// Fetches the memory of a cluster's results while another is being lit: the pictures are larger than the caches.
HWY_INLINE void fetch(const LightFrame& frame, const Cluster& cluster, const LightingData& out) {
    const std::size_t samples = frame.picks.samples, n = frame.grid.interleave;
    for (std::uint32_t i = 0; i < cluster.count; ++i)
        for (std::size_t y = 0; y < n; ++y) {
            const std::size_t p = std::min(cluster.square[i] + y * frame.grid.width, out.weight_sum.size() - n);
            fetch_lines(out.irradiance.data() + p, n * sizeof(vec3));
            fetch_lines(out.weight_sum.data() + p, n * sizeof(float));
            fetch_lines(out.light.data() + p * samples, n * samples * sizeof(float));
            fetch_lines(out.target_weight.data() + p * samples, n * samples * sizeof(float));
        }
}

template <bool soft, bool clamped>
void light_pixels(const LightFrame& frame, const PixelGroup& g, std::span<const std::uint32_t> list, BlockScratch& s,
                  LightingData& out) {
    const ReadyLight* lights = s.lights.data();
    const bool counts = !out.lights_used.empty();
    const auto first_to_pick =
        std::partition_point(list.begin(), frame.first_pick > 0 ? list.end() : list.begin(),
                             [&](std::uint32_t i) { return lights[i].index < frame.first_pick; });
    GroupSums sums;
    light_group<soft, clamped>(lights, list.data(), list.size(), first_to_pick - list.begin(), g, frame.settings.clamp2,
                               frame.picks, counts, sums, s.picks, s.batch, [&](std::size_t first) {
                                   if (counts) count_used(frame, lights, list.data() + first, g, s.batch, out);
                               });
    s.visited += list.size() * group_lanes;
    store(frame, g, sums, s.picks, out);
}

void bound(const LightFrame& frame, std::size_t cluster, BlockScratch& s) {
    const std::size_t tiles = frame.grid.tiles();
    s.clusters[cluster].bounds = bounds_of(&s.groups[cluster * tiles], tiles);
}

void light_block(const LightFrame& frame, int block, BlockScratch& s, LightingData& out) {
    load_block(frame, block, s, out);
    if (s.patches.empty()) return;
    for (std::size_t i = 0; i < s.patches.back().end; ++i) bound(frame, i, s);
    for (const Patch& patch : s.patches) {
        regroup(frame, patch, s);
        for (const std::size_t i : s.regrouped) bound(frame, i, s);
    }
    const bool counts = !out.overdraw.empty();
    find_lights(frame, counts, s);
    s.kept.resize(s.lights.size() + group_lanes);
    s.reaching.resize(s.lights.size() + 1);
    const float no_horizon = frame.settings.receiver == Receiver::soft ? 1e30f : 0.0f;
    const int tiles = frame.grid.tiles();
    std::vector<LightCube> cubes;
    with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
        for (const Patch& patch : s.patches) {
            GroupBounds bounds = bounds_of(s.clusters.data() + patch.begin, s.clusters.data() + patch.end);
            bounds.slab += no_horizon;
            cull_into(bounds, s.in_block, s.in_patch);
            if (counts) find_cubes(s, bounds, cubes);
            for (std::size_t c = patch.begin; c < patch.end; ++c) {
                if (c + 1 < patch.end) fetch(frame, s.clusters[c + 1], out);
                bounds = s.clusters[c].bounds;
                bounds.slab += no_horizon;
                s.lists.deal({s.kept.data(), cull_into(bounds, s.in_patch, s.kept.data())}, s.tile_of.data(), tiles);
                for (int tile = 0; tile < tiles; ++tile) {
                    const PixelGroup& g = s.groups[c * tiles + tile];
                    if (g.lanes == 0) continue;
                    if (counts) count_overdraw(frame, cubes, s.clusters[c].bounds, g, tile, out);
                    std::span<const std::uint32_t> list = s.lists.of(tile);
                    if (tiles > 1)
                        list = {s.reaching.data(), cull_exactly<soft>(g, s.lights.data(), list, s.reaching.data())};
                    light_pixels<soft, clamped>(frame, g, list, s, out);
                }
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
