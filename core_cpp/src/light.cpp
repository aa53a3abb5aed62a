#include "lab/light.h"

#include <algorithm>
#include <numeric>

#include "lab/interleave.h"
#include "lab/light_rows.h"
#include "lab/light_tile.h"

namespace lab {
namespace {

std::int64_t level_size(const HierarchyView& h, int level) {
    return h.offset[level + 1] - h.offset[level];
}

// The lights of one level that each interleaving tile sees.
std::vector<LightRows> deal_level(const HierarchyView& h, int level, const Params& params) {
    const int n = params.interleave, tiles = n * n;
    const auto first = static_cast<std::uint32_t>(h.offset[level]);
    const auto count = static_cast<std::uint32_t>(level_size(h, level));
    const bool dealt = is_dealt(count, n, params.deal_all);
    std::vector<std::vector<std::uint32_t>> share(tiles);
    for (std::uint32_t i = 0; i < count; ++i)
        if (dealt)
            share[dealt_tile(i, static_cast<std::uint32_t>(level), n)].push_back(first + i);
        else
            for (auto& lights : share) lights.push_back(first + i);
    std::vector<LightRows> rows;
    rows.reserve(tiles);
    const float cell = level == 0 ? h.cell_size[1] : h.cell_size[level];  // level 0 lies in level 1's cells
    for (auto& lights : share) rows.emplace_back(h, std::move(lights), cell);
    return rows;
}

// One level's lights, added to one tile of pixels.
void light_level(LightTile& tile, const LightRows& rows, const HierarchyView& h, int level, float scale,
                 const LightSettings& settings) {
    const bool top = level == h.top();
    const float outer = 2 * blend_radius(h, level, settings);
    const auto visit = [&](std::uint32_t i) {
        if (!tile.count_overdraw(h.position[i], outer, top)) return;
        const LightTerm term = light_term(h, i, level, settings, scale);
        tile.add(term, i, top ? std::numeric_limits<float>::max() / 4 : outer);
    };
    if (top)
        std::for_each(rows.lights().begin(), rows.lights().end(), visit);
    else
        rows.find({tile.box().low - outer, tile.box().high + outer}, visit);
}

}  // namespace

int first_pick_level(const HierarchyView& h, const Params& params) {
    return std::max(params.first_level, std::min(params.first_shadow_level, h.top()));
}

float deal_scale(const HierarchyView& h, int level, const Params& params) {
    const bool dealt = is_dealt(level_size(h, level), params.interleave, params.deal_all);
    return dealt ? static_cast<float>(params.interleave * params.interleave) : 1.0f;
}

LightingData light(const HierarchyView& h, const GBufferView& g, const Params& params, float scene_radius) {
    const std::size_t pixels = g.pixels();
    const int samples = params.shadow_samples, n = params.interleave;
    LightingData out;
    out.irradiance.assign(pixels, vec3(0.0f));
    out.overdraw.assign(pixels * h.cell_size.size(), 0);
    out.lights_used.assign(pixels * h.cell_size.size(), 0);
    out.light.assign(pixels * samples, -1);
    out.target_weight.assign(pixels * samples, 0.0f);
    out.weight_sum.assign(pixels, 0.0f);

    std::vector<std::vector<LightRows>> rows(h.cell_size.size());
    for (int level = params.first_level; level <= h.top(); ++level) rows[level] = deal_level(h, level, params);
    const LightSettings settings(params, scene_radius);
    const PickSettings picks{samples, params.importance, params.picker, frame_key(params.seed, params.frame)};
    const int pick_level = first_pick_level(h, params);

    // Blocks of 16 x 16 pixels of one interleaving tile; a single row of points is cut into runs.
    const int block_x = g.height == 1 ? tile_pixels : 16, block_y = tile_pixels / block_x;
    const int across = ((g.width + n - 1) / n + block_x - 1) / block_x;
    const int down = ((g.height + n - 1) / n + block_y - 1) / block_y;
#pragma omp parallel
    {
        LightTile tile(settings, picks);
        std::vector<std::uint32_t> pixel, overdraw(tile_pixels), used(tile_pixels);
#pragma omp for schedule(dynamic)
        for (int b = 0; b < across * down * n * n; ++b) {
            const int share = b % (n * n), block = b / (n * n);
            const int x0 = block % across * block_x * n + share % n, y0 = block / across * block_y * n + share / n;
            pixel.clear();
            for (int y = y0; y < std::min(g.height, y0 + block_y * n); y += n)
                for (int x = x0; x < std::min(g.width, x0 + block_x * n); x += n) {
                    const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
                    if (g.depth[p] > 0) pixel.push_back(static_cast<std::uint32_t>(p));
                }
            if (pixel.empty()) continue;
            tile.load(g, pixel);
            for (int level = params.first_level; level <= h.top(); ++level) {
                if (level == pick_level && level > params.first_level) tile.restart_picks();
                light_level(tile, rows[level][share], h, level, deal_scale(h, level, params), settings);
                tile.take_counts(overdraw.data(), used.data());
                for (int i = 0; i < tile.count(); ++i) {
                    out.overdraw[level * pixels + pixel[i]] = overdraw[i];
                    out.lights_used[level * pixels + pixel[i]] = used[i];
                }
            }
            for (int i = 0; i < tile.count(); ++i) {
                out.irradiance[pixel[i]] = tile.irradiance(i);
                out.weight_sum[pixel[i]] = tile.weight_sum(i);
                for (int s = 0; s < samples; ++s) {
                    out.light[pixel[i] * static_cast<std::size_t>(samples) + s] = tile.pick(s, i);
                    out.target_weight[pixel[i] * static_cast<std::size_t>(samples) + s] = tile.pick_weight(s, i);
                }
            }
        }
    }
    return out;
}

}  // namespace lab
