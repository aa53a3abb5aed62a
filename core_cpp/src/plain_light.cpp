#include "lab/plain_light.h"

#include <algorithm>
#include <limits>

#include "lab/random.h"
#include "lab/reservoir.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/plain_light.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

constexpr std::size_t most = 64;  // lights in a run: what they send to the group stays in the first cache

// Adds a run of lights to the sums; what each is picked by goes to `target`, light after light.
template <bool soft, bool clamped, bool picked>
void add_run(const ReadyLight* lights, std::size_t count, const PixelGroup& g, float clamp2, bool importance,
             PlainSums& sums, float* target) {
    float red[group_lanes], green[group_lanes], blue[group_lanes];
    std::copy_n(sums.red, group_lanes, red);
    std::copy_n(sums.green, group_lanes, green);
    std::copy_n(sums.blue, group_lanes, blue);
    for (std::size_t l = 0; l < count; ++l) {
        const ReadyLight light = lights[l];
        float weight[group_lanes];
#pragma omp simd
        for (int i = 0; i < group_lanes; ++i)
            weight[i] =
                receive<soft, clamped>(light, clamp2, g.px[i], g.py[i], g.pz[i], g.nx[i], g.ny[i], g.nz[i]).weight;
#pragma omp simd
        for (int i = 0; i < group_lanes; ++i) {
            red[i] += weight[i] * light.intensity.x;
            green[i] += weight[i] * light.intensity.y;
            blue[i] += weight[i] * light.intensity.z;
        }
        if constexpr (picked) {
            float* const to = target + l * group_lanes;
            const float bright = importance ? light.bright : 0.0f, even = importance ? 0.0f : 1.0f;
#pragma omp simd
            for (int i = 0; i < group_lanes; ++i) to[i] = weight[i] * bright + (weight[i] > 0.0f ? even : 0.0f);
        }
    }
    std::copy_n(red, group_lanes, sums.red);
    std::copy_n(green, group_lanes, sums.green);
    std::copy_n(blue, group_lanes, sums.blue);
}

// The state of one shadow sample's picks.
struct PlainPick {
    std::uint32_t random[group_lanes];
    float best[group_lanes];  // the running sum, or the race's smallest key
    std::int32_t light[group_lanes];
    float weight[group_lanes];
};

template <bool race>
void pick_from_run(const ReadyLight* lights, std::size_t count, const float* target, PlainPick& kept) {
    PlainPick p = kept;
    for (std::size_t l = 0; l < count; ++l) {
        const auto index = static_cast<std::int32_t>(lights[l].index);
#pragma omp simd
        for (int i = 0; i < group_lanes; ++i) {
            const float f = target[l * group_lanes + i];
            // A linear congruential generator, the least that a decision can cost; its high bits are good.
            p.random[i] = p.random[i] * 1664525u + 1013904223u;
            const float mine = race ? race_key(p.random[i], f) : p.best[i] + f;
            const bool wins = f > 0.0f && (race ? mine < p.best[i] : to_unit(p.random[i]) * mine < f);
            p.best[i] = race && !wins ? p.best[i] : mine;
            p.weight[i] = wins ? f : p.weight[i];
            p.light[i] = wins ? index : p.light[i];
        }
    }
    kept = p;
}

void plain_light(const LightSettings& settings, const PickSettings& picks, const PerfectList& list, PlainSums& sums) {
    float target[most * group_lanes];
    PlainPick pick[max_shadow_samples];
    const bool race = picks.picker == Picker::race;
    for (float* const colour : {sums.red, sums.green, sums.blue}) std::fill_n(colour, group_lanes, 0.0f);
    for (int s = 0; s < picks.samples; ++s)
        for (int i = 0; i < group_lanes; ++i) {
            pick[s].random[i] = random4(list.group.pixel[i], static_cast<std::uint32_t>(s), Stream::pick, picks.key).x;
            pick[s].best[i] = race ? std::numeric_limits<float>::infinity() : 0.0f;
            pick[s].light[i] = -1;
            pick[s].weight[i] = 0.0f;
        }
    with_kinds(settings, [&]<bool soft, bool clamped>() {
        for (std::size_t first = 0; first < list.lights.size(); first += most) {
            const ReadyLight* lights = list.lights.data() + first;
            const std::size_t count = std::min(most, list.lights.size() - first);
            if (picks.samples == 0) {
                add_run<soft, clamped, false>(lights, count, list.group, settings.clamp2, true, sums, target);
                continue;
            }
            add_run<soft, clamped, true>(lights, count, list.group, settings.clamp2, picks.importance, sums, target);
            for (int s = 0; s < picks.samples; ++s)
                race ? pick_from_run<true>(lights, count, target, pick[s])
                     : pick_from_run<false>(lights, count, target, pick[s]);
        }
    });
    for (int s = 0; s < picks.samples; ++s) {
        std::copy_n(pick[s].light, group_lanes, sums.pick + s * group_lanes);
        std::copy_n(pick[s].weight, group_lanes, sums.weight + s * group_lanes);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(plain_light);

void plain_light(const LightSettings& settings, const PickSettings& picks, const PerfectList& list, PlainSums& sums) {
    HWY_DYNAMIC_DISPATCH(plain_light)(settings, picks, list, sums);
}

}  // namespace lab
#endif
