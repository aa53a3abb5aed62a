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
void take_group(const LightFrame& frame, const PixelGroup& g, const LightColumns& near, BlockScratch& s,
                std::vector<PerfectList>& lists) {
    if (g.count < group_lanes) return;
    std::vector<std::uint32_t> kept(near.size() + group_lanes);
    const std::size_t count = cull(g.bounds, near, kept.data());
    for (std::size_t i = 0; i < count; ++i) kept[i] = near.slot(kept[i]);
    PerfectList list{g, {}};
    GroupSums sums;
    light_group<soft, clamped>(s.lights.data(), kept.data(), count, 0, g, frame.settings.clamp2, frame.picks, true,
                               sums, s.picks, s.batch, [&](std::size_t first) {
                                   for (std::size_t i = 0; i < s.batch.size; ++i)
                                       if (least_of(s.batch.target + i * group_lanes) > 0.0f)
                                           list.lights.push_back(s.lights[kept[first + i]]);
                               });
    if (!list.lights.empty()) lists.push_back(std::move(list));
}

void perfect_lists(const LightFrame& frame, std::size_t wanted, std::vector<PerfectList>& lists) {
    BlockScratch s(frame);
    LightingData none;
    const int blocks = frame.grid.count();
    const std::size_t from_each = (wanted + blocks - 1) / blocks;
    const int step = std::max(1, blocks / static_cast<int>(wanted));
    for (int block = 0; block < blocks; block += step) {
        load_block(frame, block, s, none);
        if (s.patches.empty()) continue;
        const std::size_t groups = s.patches.back().end;
        for (std::size_t i = 0; i < groups; ++i) s.groups[i].bounds = bounds_of(s.groups[i]);
        find_lights(frame, s);
        const std::size_t every = std::max<std::size_t>(1, groups / from_each);
        for (const Patch& patch : s.patches)
            for (std::size_t i = patch.begin; i < patch.end; ++i)
                if (i % every == every / 2)
                    with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
                        take_group<soft, clamped>(frame, s.groups[i], s.dealt[patch.tile], s, lists);
                    });
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
