#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/limit_light.cpp"
#include <hwy/foreach_target.h>

#include <omp.h>

#include <numeric>

#include "lab/limit_light.h"
#include "lab/plain_light.h"
//
#include "lab/light_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// One list by the kernel of stage light; `counting`: 0, 1, .. as far as it is long. Its picks are left in the scratch.
void own_light(const LightFrame& frame, const PerfectList& list, const std::uint32_t* counting, BlockScratch& s,
               PlainSums& result) {
    GroupSums sums;
    with_kinds(frame.settings, [&]<bool soft, bool clamped>() {
        light_group<soft, clamped>(list.lights.data(), counting, list.lights.size(), 0, list.group,
                                   frame.settings.clamp2, frame.picks, false, sums, s.picks, s.batch,
                                   [](std::size_t) {});
    });
    std::copy_n(sums.red, group_lanes, result.red);
    std::copy_n(sums.green, group_lanes, result.green);
    std::copy_n(sums.blue, group_lanes, result.blue);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(own_light);

constexpr std::size_t wanted_lists = 128;  // enough of a picture, and little enough for the second cache
constexpr int trials = 5;

// The lists of a picture, and what walks one of them by either kernel.
struct Walk {
    const LightFrame& frame;
    std::vector<PerfectList> lists;
    std::vector<std::uint32_t> counting;
    std::size_t lights = 0;

    explicit Walk(const LightFrame& of) : frame(of), lists(perfect_lists(of, wanted_lists)) {
        std::size_t longest = 0;
        for (const PerfectList& list : lists) {
            lights += list.lights.size();
            longest = std::max(longest, list.lights.size());
        }
        counting.resize(longest);
        std::iota(counting.begin(), counting.end(), 0u);
    }

    void one(LightKernel kernel, const PerfectList& list, BlockScratch& scratch, PlainSums& sums) const {
        if (kernel == LightKernel::plain)
            plain_light(frame.settings, frame.picks, list, sums);
        else
            HWY_DYNAMIC_DISPATCH(own_light)(frame, list, counting.data(), scratch, sums);
    }

    // All lists; returns something that depends on all results.
    float all(LightKernel kernel, BlockScratch& scratch, PlainSums& sums) const {
        float result = 0;
        for (const PerfectList& list : lists) {
            one(kernel, list, scratch, sums);
            result += sums.red[0] + sums.weight[0] + scratch.picks.sum[0];
        }
        return result;
    }
};

}  // namespace

double light_kernel_rate(LightKernel kernel, const HierarchyView& h, const GBufferView& g, const Params& params,
                         float scene_radius, double seconds) {
    const LightFrame frame(h, g, params, scene_radius);
    const Walk walk(frame);
    if (walk.lights == 0) return 0;
    std::vector<double> rates;
    for (int trial = 0; trial < trials; ++trial) {
        double rate = 0;
        float result = 0;
#pragma omp parallel reduction(+ : rate, result)
        {
            BlockScratch scratch(frame);
            scratch.picks.clear(frame.picks.picker);
            PlainSums sums{};
            result += walk.all(kernel, scratch, sums);
#pragma omp barrier
            const double begin = omp_get_wtime();
            std::size_t rounds = 0;
            double taken = 0;
            for (; taken < seconds / trials; ++rounds) {
                result += walk.all(kernel, scratch, sums);
                taken = omp_get_wtime() - begin;
            }
            rate += static_cast<double>(rounds * walk.lights * group_lanes) / taken;
        }
        volatile float kept = result;  // so that none of the work is left out
        (void)kept;
        rates.push_back(rate);
    }
    std::nth_element(rates.begin(), rates.begin() + trials / 2, rates.end());
    return rates[trials / 2];
}

std::vector<vec3> light_kernel_sums(LightKernel kernel, const HierarchyView& h, const GBufferView& g,
                                    const Params& params, float scene_radius) {
    const LightFrame frame(h, g, params, scene_radius);
    const Walk walk(frame);
    BlockScratch scratch(frame);
    std::vector<vec3> found;
    for (const PerfectList& list : walk.lists) {
        PlainSums sums{};
        walk.one(kernel, list, scratch, sums);
        for (int i = 0; i < group_lanes; ++i) found.emplace_back(sums.red[i], sums.green[i], sums.blue[i]);
    }
    return found;
}

}  // namespace lab
#endif
