#include <algorithm>

#include "lab/interleave.h"
#include "lab/light_block.h"

namespace lab {
namespace {

constexpr int patch_edge = 16;  // squares

// Blocks are larger where squares are, so that a search serves as many groups.
int block_edge(int n) {
    return std::max(64, 2 * patch_edge * n);  // pixels
}

bool level_is_dealt(const HierarchyView& h, int level, const Params& params) {
    return is_dealt(h.offset[level + 1] - h.offset[level], params.interleave, params.deal_all);
}

std::vector<float> deal_scales(const HierarchyView& h, const Params& params) {
    std::vector<float> scales;
    for (int level = 0; level <= h.top(); ++level) scales.push_back(deal_scale(h, level, params));
    return scales;
}

// The interleaving tile of every light; nothing where there is but one.
Buffer<std::uint8_t> deal(const HierarchyView& h, const Params& params) {
    Buffer<std::uint8_t> tile_of;
    if (params.interleave == 1) return tile_of;
    tile_of.resize(h.position.size());
    for (int level = params.first_level; level <= h.top(); ++level) {
        const std::int64_t tiles = params.interleave * params.interleave, count = h.offset[level + 1] - h.offset[level];
        std::uint8_t* const of = tile_of.data() + h.offset[level];
        if (!level_is_dealt(h, level, params)) {
            std::fill_n(of, count, every_tile);
            continue;
        }
#pragma omp parallel for
        for (std::int64_t first = 0; first < count; first += tiles) {
            const DealtRun run(static_cast<std::uint32_t>(first / tiles), static_cast<std::uint32_t>(level),
                               params.interleave);
            for (std::int64_t i = 0; i < std::min(tiles, count - first); ++i)
                of[first + i] = static_cast<std::uint8_t>(run.tile(static_cast<std::uint32_t>(i)));
        }
    }
    return tile_of;
}

}  // namespace

int first_pick_level(const HierarchyView& h, const Params& params) {
    return std::max(params.first_level, std::min(params.first_shadow_level, h.top()));
}

float deal_scale(const HierarchyView& h, int level, const Params& params) {
    return level_is_dealt(h, level, params) ? static_cast<float>(params.interleave * params.interleave) : 1.0f;
}

BlockGrid::BlockGrid(const GBufferView& g, int n) : width(g.width), height(g.height), interleave(n) {
    const int edge = block_edge(n);
    if (height == 1) {  // a row of points
        block_x = edge * edge / n;
        patch_x = patch_edge * patch_edge * n;
        block_y = patch_y = 1;
    } else {
        block_x = block_y = edge;
        patch_x = patch_y = patch_edge * n;
    }
}

LightFrame::LightFrame(const HierarchyView& h, const GBufferView& g, const Params& params, float scene_radius)
    : hierarchy(h),
      gbuffer(g),
      settings(params, scene_radius),
      picks{params.shadow_samples, params.importance, params.picker, frame_key(params.seed, params.frame)},
      grid(g, params.interleave),
      lights(h, settings, deal_scales(h, params)),
      tile_of(deal(h, params)) {
    for (int level = 0; level <= h.top(); ++level) rows.emplace_back(h, level);
    const int pick_level = first_pick_level(h, params);
    first_pick = pick_level > params.first_level ? static_cast<std::uint32_t>(h.offset[pick_level]) : 0;
}

}  // namespace lab
