#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/perfect_list.cpp"
#include <hwy/foreach_target.h>

#include "lab/perfect_list.h"
//
#include "lab/cull_lanes.h"
#include "lab/light_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// Adds the perfect list of one group of a block.
template <bool soft, bool clamped>
void take_group(const LightFrame& frame, const PixelGroup& g, std::span<const std::uint32_t> near, BlockScratch& s,
                std::vector<PerfectList>& lists) {
    if (g.lanes != every_lane) return;
    PerfectList list{g, {}};
    GroupSums sums;
    light_group<soft, clamped>(s.lights.data(), near.data(), near.size(), 0, g, frame.settings.clamp2, frame.picks,
                               true, sums, s.picks, s.batch, [&](std::size_t first) {
                                   for (std::size_t i = 0; i < s.batch.size; ++i)
                                       if (least_of(s.batch.target + i * group_lanes) > 0.0f)
                                           list.lights.push_back(s.lights[near[first + i]]);
                               });
    if (!list.lights.empty()) lists.push_back(std::move(list));
}

void perfect_lists(const LightFrame& frame, std::size_t wanted, std::vector<PerfectList>& lists) {
    BlockScratch s(frame);
    LightingData none;
    const int blocks = frame.grid.count();
    const std::size_t tiles = frame.grid.tiles(), from_each = (wanted + blocks - 1) / blocks;
    const int step = std::max(1, blocks / static_cast<int>(wanted));
    for (int block = 0; block < blocks; block += step) {
        load_block(frame, block, s, none);
        if (s.patches.empty()) continue;
        const std::size_t clusters = s.patches.back().end, groups = clusters * tiles;
        for (std::size_t c = 0; c < clusters; ++c) s.clusters[c].bounds = bounds_of(&s.groups[c * tiles], tiles);
        find_lights(frame, false, s);
        s.kept.resize(s.lights.size() + group_lanes);
        const std::size_t every = std::max<std::size_t>(1, groups / from_each);
        for (std::size_t i = every / 2; i < groups; i += every) {
            const std::size_t count = cull_into(s.clusters[i / tiles].bounds, s.in_block, s.kept.data());
            s.lists.deal({s.kept.data(), count}, s.tile_of.data(), static_cast<int>(tiles));
            with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
                take_group<soft, clamped>(frame, s.groups[i], s.lists.of(static_cast<int>(i % tiles)), s, lists);
            });
        }
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(perfect_lists);

std::vector<PerfectList> perfect_lists(const LightFrame& frame, std::size_t wanted) {
    std::vector<PerfectList> lists;
    HWY_DYNAMIC_DISPATCH(perfect_lists)(frame, wanted, lists);
    return lists;
}

}  // namespace lab
#endif
