#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/limit_light.cpp"
#include <hwy/foreach_target.h>

#include <chrono>
#include <numeric>

#include "lab/light_block.h"
#include "lab/limit_light.h"
//
#include "lab/cull_lanes.h"
#include "lab/light_lanes.h"

#ifndef LAB_PERFECT_LIST
#define LAB_PERFECT_LIST
namespace lab {
namespace {

// A group of pixels, and lights each of which reaches all of them.
struct PerfectList {
    PixelGroup group;
    std::vector<ReadyLight> lights;
};

}  // namespace
}  // namespace lab
#endif

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
    const std::size_t count = cull(bounds_of(g), near, kept.data());
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

// About `wanted` lists, from all over the picture.
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

// Walks all lists once; returns something that depends on all results.
float walk_lists(const LightFrame& frame, const std::vector<PerfectList>& lists, const std::uint32_t* counting,
                 BlockScratch& s) {
    float result = 0;
    with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
        for (const PerfectList& list : lists) {
            GroupSums sums;
            light_group<soft, clamped>(list.lights.data(), counting, list.lights.size(), 0, list.group,
                                       frame.settings.clamp2, frame.picks, false, sums, s.picks, s.batch,
                                       [](std::size_t) {});
            result += sums.red[0] + s.picks.sum[0];
        }
    });
    return result;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(perfect_lists);
HWY_EXPORT(walk_lists);

constexpr std::size_t wanted_lists = 128;  // enough of a picture, and little enough for the second cache
constexpr int trials = 5;

double seconds_now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

double light_kernel_rate(const HierarchyView& h, const GBufferView& g, const Params& params, float scene_radius,
                         double seconds) {
    const LightFrame frame(h, g, params, scene_radius);
    std::vector<PerfectList> lists;
    HWY_DYNAMIC_DISPATCH(perfect_lists)(frame, wanted_lists, lists);
    std::size_t lights = 0, longest = 0;
    for (const PerfectList& list : lists) {
        lights += list.lights.size();
        longest = std::max(longest, list.lights.size());
    }
    if (lights == 0) return 0;
    std::vector<std::uint32_t> counting(longest);
    std::iota(counting.begin(), counting.end(), 0u);

    std::vector<double> rates;
    for (int trial = 0; trial < trials; ++trial) {
        double rate = 0;
        float result = 0;
#pragma omp parallel reduction(+ : rate, result)
        {
            BlockScratch scratch(frame);
            result += HWY_DYNAMIC_DISPATCH(walk_lists)(frame, lists, counting.data(), scratch);
#pragma omp barrier
            const double begin = seconds_now();
            std::size_t rounds = 0;
            double taken = 0;
            for (; taken < seconds / trials; ++rounds) {
                result += HWY_DYNAMIC_DISPATCH(walk_lists)(frame, lists, counting.data(), scratch);
                taken = seconds_now() - begin;
            }
            rate += static_cast<double>(rounds * lights * group_lanes) / taken;
        }
        volatile float kept = result;  // so that none of the work is left out
        (void)kept;
        rates.push_back(rate);
    }
    std::nth_element(rates.begin(), rates.begin() + trials / 2, rates.end());
    return rates[trials / 2];
}

}  // namespace lab
#endif
