#include <algorithm>

#include "lab/light_block.h"

namespace lab {
namespace {

constexpr float bent = 0.3f;       // a group whose normals differ by more is worth another grouping
constexpr float stretched = 3.0f;  // as is one so many times as large as most of its patch

void leave_dark(const LightFrame& frame, std::size_t p, LightingData& out) {
    if (out.irradiance.empty()) return;
    const std::size_t samples = frame.picks.samples;
    out.irradiance[p] = vec3(0.0f);
    out.weight_sum[p] = 0.0f;
    std::fill_n(out.light.begin() + p * samples, samples, -1);
    std::fill_n(out.target_weight.begin() + p * samples, samples, 0.0f);
}

// The pixels of one interleaving tile in a patch that see a surface, square after square of one group each; those that
// see none get their results at once.
void list_pixels(const LightFrame& frame, int x0, int y0, int tile, std::vector<std::uint32_t>& pixels,
                 LightingData& out) {
    const BlockGrid& grid = frame.grid;
    const int n = grid.interleave, x1 = std::min(grid.width, x0 + grid.patch_x),
              y1 = std::min(grid.height, y0 + grid.patch_y);
    const int square_x = (grid.patch_y == 1 ? group_lanes : 4) * n, square_y = 4 * n;
    pixels.clear();
    for (int sy = y0; sy < y1; sy += square_y)
        for (int sx = x0; sx < x1; sx += square_x)
            for (int y = sy + tile / n; y < std::min(y1, sy + square_y); y += n)
                for (int x = sx + tile % n; x < std::min(x1, sx + square_x); x += n) {
                    const std::size_t p = static_cast<std::size_t>(y) * grid.width + x;
                    if (frame.gbuffer.depth[p] > 0)
                        pixels.push_back(static_cast<std::uint32_t>(p));
                    else
                        leave_dark(frame, p, out);
                }
}

// Bit i of five spread to bit 6 i, for a Morton code of six axes.
std::uint32_t spread(float unit) {
    const auto x = static_cast<std::uint32_t>(smaller(31.0f, larger(0.0f, 32.0f * unit)));
    return (x & 1u) | (x & 2u) << 5 | (x & 4u) << 10 | (x & 8u) << 15 | (x & 16u) << 20;
}

// Sorts pixels along a Morton curve through places and normals: runs of them stay compact in both even where the
// picture jumps in depth or a surface bends. Ties keep their order.
void sort_in_space(const GBufferView& g, std::vector<std::uint32_t>& pixels) {
    vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const std::uint32_t p : pixels) {
        low = glm::min(low, g.position[p]);
        high = glm::max(high, g.position[p]);
    }
    const vec3 extent = high - low;
    int axis[3] = {0, 1, 2};  // the longest decides first
    std::sort(axis, axis + 3, [&](int a, int b) { return extent[a] > extent[b] || (extent[a] == extent[b] && a < b); });
    const float longest = extent[axis[0]], scale = longest > 0 ? 1.0f / longest : 0.0f;
    std::vector<std::uint64_t> keyed(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const vec3 at = (g.position[pixels[i]] - low) * scale, normal = 0.5f + 0.25f * g.normal[pixels[i]];
        std::uint64_t code = 0;
        for (int a = 0; a < 3; ++a) code |= spread(at[axis[a]]) << (5 - 2 * a) | spread(normal[axis[a]]) << (4 - 2 * a);
        keyed[i] = code << 32 | pixels[i];
    }
    std::sort(keyed.begin(), keyed.end());
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint32_t>(keyed[i]);
}

void load_group(const GBufferView& g, const std::uint32_t* pixel, int count, PixelGroup& group) {
    group.count = count;
    for (int i = 0; i < group_lanes; ++i) {
        const std::uint32_t p = pixel[std::min(i, count - 1)];
        const vec3 position = g.position[p], normal = g.normal[p];
        group.px[i] = position.x;
        group.py[i] = position.y;
        group.pz[i] = position.z;
        group.nx[i] = normal.x;
        group.ny[i] = normal.y;
        group.nz[i] = normal.z;
        group.pixel[i] = p;
    }
}

// Takes pixels into groups group_at(0), group_at(1), ..
template <class GroupAt>
void load_groups(const GBufferView& g, const std::vector<std::uint32_t>& pixels, const GroupAt& group_at) {
    for (std::size_t first = 0; first < pixels.size(); first += group_lanes) {
        const std::size_t count = std::min<std::size_t>(group_lanes, pixels.size() - first);
        load_group(g, pixels.data() + first, static_cast<int>(count), group_at(first / group_lanes));
    }
}

}  // namespace

void load_block(const LightFrame& frame, int block, BlockScratch& s, LightingData& out) {
    const BlockGrid& grid = frame.grid;
    const int x0 = block % grid.across() * grid.block_x, y0 = block / grid.across() * grid.block_y;
    const int n = grid.interleave;
    std::size_t groups = 0;
    s.patches.clear();
    for (int y = y0; y < std::min(grid.height, y0 + grid.block_y); y += grid.patch_y)
        for (int x = x0; x < std::min(grid.width, x0 + grid.block_x); x += grid.patch_x)
            for (int tile = 0; tile < n * n; ++tile) {
                list_pixels(frame, x, y, tile, s.pixels, out);
                if (s.pixels.empty()) continue;
                const std::size_t more = (s.pixels.size() + group_lanes - 1) / group_lanes;
                if (s.groups.size() < groups + more) s.groups.resize(groups + more);
                load_groups(frame.gbuffer, s.pixels,
                            [&](std::size_t i) -> PixelGroup& { return s.groups[groups + i]; });
                s.patches.push_back({groups, groups + more, tile});
                groups += more;
            }
}

void regroup(const LightFrame& frame, const Patch& patch, BlockScratch& s) {
    s.regrouped.clear();
    if (frame.grid.interleave > 1) return;  // sorting costs more than it saves where a pixel has few lights
    s.radii.clear();
    for (std::size_t i = patch.begin; i < patch.end; ++i) s.radii.push_back(s.groups[i].bounds.radius());
    std::nth_element(s.radii.begin(), s.radii.begin() + s.radii.size() / 2, s.radii.end());
    const float large = stretched * s.radii[s.radii.size() / 2];
    s.pixels.clear();
    for (std::size_t i = patch.begin; i < patch.end; ++i) {
        const PixelGroup& g = s.groups[i];
        if (g.bounds.radius() <= large && g.bounds.spread <= bent) continue;
        s.regrouped.push_back(i);
        s.pixels.insert(s.pixels.end(), g.pixel, g.pixel + g.count);
    }
    if (s.regrouped.size() < 2) {
        s.regrouped.clear();
        return;
    }
    sort_in_space(frame.gbuffer, s.pixels);
    load_groups(frame.gbuffer, s.pixels, [&](std::size_t i) -> PixelGroup& { return s.groups[s.regrouped[i]]; });
}

void find_lights(const LightFrame& frame, BlockScratch& s) {
    const HierarchyView& h = frame.hierarchy;
    vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const Patch& patch : s.patches)
        for (std::size_t i = patch.begin; i < patch.end; ++i) {
            const GroupBounds& b = s.groups[i].bounds;
            low = glm::min(low, b.centre - b.extent);
            high = glm::max(high, b.centre + b.extent);
        }
    s.lights.clear();
    for (LightColumns& lights : s.dealt) lights.clear();
    for (int level = frame.settings.first_level; level <= h.top(); ++level) {
        const bool dealt = frame.dealt[level];
        const auto visit = [&](std::uint32_t i) {
            const auto slot = static_cast<std::uint32_t>(s.lights.size());
            s.lights.push_back(frame.lights.of(i, level));
            if (dealt)
                s.dealt[frame.tile_of[i]].push(s.lights.back(), slot);
            else
                for (LightColumns& lights : s.dealt) lights.push(s.lights.back(), slot);
        };
        if (level == h.top()) {
            for (std::int64_t i = h.offset[level]; i < h.offset[level + 1]; ++i) visit(static_cast<std::uint32_t>(i));
        } else {
            const float outer = 2 * blend_radius(h, level, frame.settings);
            frame.rows[level].find({low - outer, high + outer}, visit);
        }
    }
}

}  // namespace lab
