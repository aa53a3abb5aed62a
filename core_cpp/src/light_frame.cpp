#include <algorithm>

#include "lab/interleave.h"
#include "lab/light_block.h"

namespace lab {
namespace {

constexpr int block_edge = 64, patch_edge = 16;  // pixels of the block, and of one interleaving tile in a patch

bool level_is_dealt(const HierarchyView& h, int level, const Params& params) {
    return is_dealt(h.offset[level + 1] - h.offset[level], params.interleave, params.deal_all);
}

std::vector<float> deal_scales(const HierarchyView& h, const Params& params) {
    std::vector<float> scales;
    for (int level = 0; level <= h.top(); ++level) scales.push_back(deal_scale(h, level, params));
    return scales;
}

// The interleaving tile of every light drawn; nothing where there is but one.
Buffer<std::uint8_t> deal(const HierarchyView& h, const Params& params) {
    Buffer<std::uint8_t> tile_of;
    if (params.interleave == 1) return tile_of;
    tile_of.resize(h.position.size());
    for (int level = params.first_level; level <= h.top(); ++level)
#pragma omp parallel for
        for (std::int64_t i = h.offset[level]; i < h.offset[level + 1]; ++i)
            tile_of[i] = static_cast<std::uint8_t>(dealt_tile(static_cast<std::uint32_t>(i - h.offset[level]),
                                                              static_cast<std::uint32_t>(level), params.interleave));
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
    if (height == 1) {  // a row of points
        block_x = block_edge * block_edge;
        patch_x = std::min(patch_edge * patch_edge * n, block_x);
        block_y = patch_y = 1;
    } else {
        block_x = block_y = block_edge;
        patch_x = patch_y = std::min(patch_edge * n, block_edge);
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
    for (int level = 0; level <= h.top(); ++level) {
        dealt.push_back(level_is_dealt(h, level, params));
        rows.emplace_back(h, level);
    }
    const int pick_level = first_pick_level(h, params);
    first_pick = pick_level > params.first_level ? static_cast<std::uint32_t>(h.offset[pick_level]) : 0;
}

}  // namespace lab
