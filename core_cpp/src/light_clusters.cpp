#include <algorithm>
#include <bit>

#include "lab/light_block.h"
#include "lab/simd.h"

namespace lab {
namespace {

constexpr float bent = 0.3f;       // a cluster whose normals differ by more is worth another grouping
constexpr float stretched = 3.0f;  // as is one so many times as large as most of its patch

void leave_dark(const LightFrame& frame, std::size_t p, LightingData& out) {
    if (out.irradiance.empty()) return;
    const std::size_t samples = frame.picks.samples;
    out.irradiance[p] = vec3(0.0f);
    out.weight_sum[p] = 0.0f;
    std::fill_n(out.light.begin() + p * samples, samples, -1);
    std::fill_n(out.target_weight.begin() + p * samples, samples, 0.0f);
}

// Calls visit(tile, pixel) for the pixels of a square that lie in the picture.
template <class Visit>
void each_pixel(const BlockGrid& grid, std::uint32_t square, const Visit& visit) {
    const int n = grid.interleave, x = static_cast<int>(square % grid.width), y = static_cast<int>(square / grid.width);
    for (int ty = 0; ty < std::min(n, grid.height - y); ++ty)
        for (int tx = 0; tx < std::min(n, grid.width - x); ++tx)
            visit(ty * n + tx, square + static_cast<std::uint32_t>(ty * grid.width + tx));
}

// A pixel of the square that sees a surface.
std::uint32_t seen_pixel(const LightFrame& frame, std::uint32_t square) {
    if (frame.gbuffer.depth[square] > 0) return square;
    std::uint32_t seen = square;
    each_pixel(frame.grid, square, [&](int, std::uint32_t p) {
        if (frame.gbuffer.depth[p] > 0) seen = p;
    });
    return seen;
}

// Whether a whole square lies in the picture and all its pixels see a surface.
bool is_full(const LightFrame& frame, int x, int y) {
    const BlockGrid& grid = frame.grid;
    const int n = grid.interleave;
    if (x + n > grid.width || y + n > grid.height) return false;
    const float* depth = frame.gbuffer.depth.data() + static_cast<std::size_t>(y) * grid.width + x;
    bool dark = false;
    for (int ty = 0; ty < n; ++ty)
        for (int tx = 0; tx < n; ++tx) dark |= !(depth[ty * grid.width + tx] > 0);
    return !dark;
}

// Fetches what a square's pixels see, which will be read out of order.
LAB_INLINE void fetch(const LightFrame& frame, std::uint32_t square) {
    const BlockGrid& grid = frame.grid;
    const GBufferView& g = frame.gbuffer;
    const std::size_t last = g.depth.size() - 1;
    for (int y = 0; y < grid.interleave; ++y) {
        const std::size_t p = std::min(last, static_cast<std::size_t>(square) + y * grid.width);
        __builtin_prefetch(&g.position[p]);
        __builtin_prefetch(&g.normal[p]);
    }
}

// Lists the squares of a patch that see a surface, those of one cluster after the other; pixels that see none get their
// results at once. Returns whether all squares are full.
bool list_squares(const LightFrame& frame, int x0, int y0, std::vector<std::uint32_t>& squares, LightingData& out) {
    const BlockGrid& grid = frame.grid;
    const int n = grid.interleave, x1 = std::min(grid.width, x0 + grid.patch_x),
              y1 = std::min(grid.height, y0 + grid.patch_y);
    const int cluster_x = (grid.patch_y == 1 ? group_lanes : 4) * n, cluster_y = 4 * n;
    bool all_full = true;
    for (int cy = y0; cy < y1; cy += cluster_y)
        for (int cx = x0; cx < x1; cx += cluster_x)
            for (int y = cy; y < std::min(y1, cy + cluster_y); y += n)
                for (int x = cx; x < std::min(x1, cx + cluster_x); x += n) {
                    const auto square = static_cast<std::uint32_t>(y * grid.width + x);
                    fetch(frame, square);
                    bool seen = is_full(frame, x, y);
                    if (!seen) {
                        int dark = 0, pixels = 0;
                        each_pixel(grid, square, [&](int, std::uint32_t p) {
                            ++pixels;
                            if (frame.gbuffer.depth[p] > 0) return;
                            ++dark;
                            leave_dark(frame, p, out);
                        });
                        seen = dark < pixels;
                        all_full = all_full && !seen;
                    }
                    if (seen) squares.push_back(square);
                }
    return all_full;
}

// Halves runs of squares across their longest side until each is one cluster's.
void halve(SquareSite* begin, SquareSite* end) {
    while (end - begin > group_lanes) {
        vec3 low = begin->at, high = low;
        for (const SquareSite* s = begin + 1; s < end; ++s) {
            low = glm::min(low, s->at);
            high = glm::max(high, s->at);
        }
        const vec3 extent = high - low;
        const int axis = extent.x >= larger(extent.y, extent.z) ? 0 : extent.y >= extent.z ? 1 : 2;
        const std::ptrdiff_t clusters = (end - begin + group_lanes - 1) / group_lanes;
        SquareSite* const middle = begin + (clusters + 1) / 2 * group_lanes;
        std::nth_element(begin, middle, end, [axis](const SquareSite& s, const SquareSite& t) {
            return s.at[axis] < t.at[axis] || (s.at[axis] == t.at[axis] && s.square < t.square);
        });
        halve(begin, middle);
        begin = middle;
    }
}

// Orders squares so that runs of them are compact in space even where the picture jumps in depth or a surface is seen
// at a low angle.
void sort_in_space(const LightFrame& frame, std::span<std::uint32_t> squares, BlockScratch& s) {
    s.sites.clear();
    for (const std::uint32_t square : squares)
        s.sites.push_back({frame.gbuffer.position[seen_pixel(frame, square)], square});
    halve(s.sites.data(), s.sites.data() + s.sites.size());
    for (std::size_t i = 0; i < squares.size(); ++i) squares[i] = s.sites[i].square;
}

LAB_INLINE void load_pixel(const GBufferView& g, std::uint32_t p, int lane, PixelGroup& group) {
    const vec3 &position = g.position[p], &normal = g.normal[p];
    group.px[lane] = position.x;
    group.py[lane] = position.y;
    group.pz[lane] = position.z;
    group.nx[lane] = normal.x;
    group.ny[lane] = normal.y;
    group.nz[lane] = normal.z;
    group.pixel[lane] = p;
}

// One tile's pixels of a cluster, which all see a surface.
void load_group(const GBufferView& g, const Cluster& cluster, std::uint32_t step, PixelGroup& group) {
    for (int i = 0; i < group_lanes; ++i) load_pixel(g, cluster.square[i] + step, i, group);
    group.lanes = (1u << cluster.count) - 1;
}

void repeat_lane(PixelGroup& group, int from, int to) {
    for (float* row : {group.px, group.py, group.pz, group.nx, group.ny, group.nz}) row[to] = row[from];
    group.pixel[to] = group.pixel[from];
}

// The same where some pixels see none, or lie beyond the picture.
void load_seen(const LightFrame& frame, const Cluster& cluster, PixelGroup* groups) {
    const GBufferView& g = frame.gbuffer;
    const int tiles = frame.grid.tiles();
    for (int tile = 0; tile < tiles; ++tile) groups[tile].lanes = 0;
    for (std::uint32_t i = 0; i < cluster.count; ++i)
        each_pixel(frame.grid, cluster.square[i], [&](int tile, std::uint32_t p) {
            if (!(g.depth[p] > 0)) return;
            PixelGroup& group = groups[tile];
            load_pixel(g, p, static_cast<int>(i), group);
            group.lanes |= 1u << i;
        });
    for (int tile = 0; tile < tiles; ++tile) {
        PixelGroup& group = groups[tile];
        if (group.lanes == 0) continue;
        const int first = std::countr_zero(group.lanes);
        for (int i = 0; i < group_lanes; ++i)
            if (!(group.lanes >> i & 1u)) repeat_lane(group, first, i);
    }
}

// Takes squares into clusters cluster_at(0), cluster_at(1), .. `full`: all of them are.
template <class ClusterAt>
void load_clusters(const LightFrame& frame, std::span<const std::uint32_t> squares, bool full, BlockScratch& s,
                   const ClusterAt& cluster_at) {
    const int n = frame.grid.interleave;
    for (std::size_t first = 0; first < squares.size(); first += group_lanes) {
        const std::size_t at = cluster_at(first / group_lanes);
        Cluster& cluster = s.clusters[at];
        cluster.count = static_cast<std::uint32_t>(std::min<std::size_t>(group_lanes, squares.size() - first));
        for (std::uint32_t i = 0; i < group_lanes; ++i)
            cluster.square[i] = squares[first + std::min(i, cluster.count - 1)];
        PixelGroup* const groups = s.groups.data() + at * frame.grid.tiles();
        if (!full) {
            load_seen(frame, cluster, groups);
            continue;
        }
        for (int tile = 0; tile < frame.grid.tiles(); ++tile)
            load_group(frame.gbuffer, cluster, static_cast<std::uint32_t>(tile / n * frame.grid.width + tile % n),
                       groups[tile]);
    }
}

// The squares of one patch among the block's; `full`: all of them are.
struct ListedPatch {
    std::size_t first, count;
    bool full;
};

}  // namespace

void load_block(const LightFrame& frame, int block, BlockScratch& s, LightingData& out) {
    const BlockGrid& grid = frame.grid;
    const int x0 = block % grid.across() * grid.block_x, y0 = block / grid.across() * grid.block_y;
    const int x1 = std::min(grid.width, x0 + grid.block_x), y1 = std::min(grid.height, y0 + grid.block_y);
    for (int y = y0; y < y1; ++y)  // rows of a block are too short for the processor to foresee
        for (int x = x0; x < x1; x += 16) __builtin_prefetch(&frame.gbuffer.depth[y * grid.width + x]);
    std::size_t clusters = 0;
    s.patches.clear();
    s.squares.clear();
    std::vector<ListedPatch> listed;
    for (int y = y0; y < y1; y += grid.patch_y)
        for (int x = x0; x < x1; x += grid.patch_x) {
            const std::size_t first = s.squares.size();
            const bool full = list_squares(frame, x, y, s.squares, out);
            if (s.squares.size() == first) continue;
            const std::size_t end = clusters + (s.squares.size() - first + group_lanes - 1) / group_lanes;
            s.patches.push_back({clusters, end});
            listed.push_back({first, s.squares.size() - first, full});
            clusters = end;
        }
    if (s.clusters.size() < clusters) {
        s.clusters.resize(clusters);
        s.groups.resize(clusters * grid.tiles());
    }
    for (std::size_t i = 0; i < listed.size(); ++i) {
        const std::span squares(s.squares.data() + listed[i].first, listed[i].count);
        if (grid.interleave > 1) sort_in_space(frame, squares, s);  // little work where it serves many groups
        const std::size_t begin = s.patches[i].begin;
        load_clusters(frame, squares, listed[i].full, s, [begin](std::size_t c) { return begin + c; });
    }
}

void regroup(const LightFrame& frame, const Patch& patch, BlockScratch& s) {
    s.regrouped.clear();
    if (frame.grid.interleave > 1) return;  // sorted already
    s.radii.clear();
    for (std::size_t i = patch.begin; i < patch.end; ++i) s.radii.push_back(s.clusters[i].bounds.radius());
    std::nth_element(s.radii.begin(), s.radii.begin() + s.radii.size() / 2, s.radii.end());
    const float large = stretched * s.radii[s.radii.size() / 2];
    s.squares.clear();
    for (std::size_t i = patch.begin; i < patch.end; ++i) {
        const Cluster& c = s.clusters[i];
        if (c.bounds.radius() <= large && c.bounds.spread <= bent) continue;
        s.regrouped.push_back(i);
        s.squares.insert(s.squares.end(), c.square, c.square + c.count);
    }
    if (s.regrouped.size() < 2) {
        s.regrouped.clear();
        return;
    }
    sort_in_space(frame, s.squares, s);
    load_clusters(frame, s.squares, true, s, [&](std::size_t i) { return s.regrouped[i]; });
}

}  // namespace lab
