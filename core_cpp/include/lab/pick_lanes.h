// Shadow samples picked for a group of pixels from batches of lights.
#if defined(LAB_PICK_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_PICK_LANES_H
#undef LAB_PICK_LANES_H
#else
#define LAB_PICK_LANES_H
#endif

#include <hwy/highway.h>

#include "lab/light_picks.h"
#include "lab/random.h"
#include "lab/receive_lanes.h"
#include "lab/reservoir.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// `count` reservoirs, from `first`, pass by a batch.
template <int count>
HWY_INLINE void pass_batch(const LightBatch& batch, GroupPicks& picks, int first,
                           const float (&point)[4][group_lanes]) {
    const hn::CappedTag<float, group_lanes> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    using V = hn::Vec<decltype(d)>;
    using I = hn::Vec<decltype(di)>;
    const auto size = static_cast<std::int32_t>(batch.size);
    for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
        // Each on its own: arrays of vectors are not for every instruction set.
        const V p0 = hn::LoadU(d, point[0] + lane), p1 = hn::LoadU(d, point[1] + lane);
        const V p2 = hn::LoadU(d, point[2] + lane), p3 = hn::LoadU(d, point[3] + lane);
        I passed0 = hn::Zero(di), passed1 = passed0, passed2 = passed0, passed3 = passed0, number = passed0;
        const I one = hn::Set(di, 1);
        V after = hn::Zero(d);
        const auto pass = [&](V at, I passed) HWY_ATTR {  // reservoir_pass
            return hn::IfThenElse(hn::RebindMask(di, hn::Le(after, at)), number, passed);
        };
        for (std::int32_t i = 0; i < size; ++i) {
            after = hn::Add(after, hn::LoadU(d, batch.target + i * group_lanes + lane));
            number = hn::Add(number, one);
            passed0 = pass(p0, passed0);
            if constexpr (count > 1) passed1 = pass(p1, passed1);
            if constexpr (count > 2) passed2 = pass(p2, passed2);
            if constexpr (count > 3) passed3 = pass(p3, passed3);
        }
        const auto settle = [&](int s, I passed) HWY_ATTR {
            std::int32_t* pick = picks.light.data() + (first + s) * group_lanes + lane;
            float* weight = picks.weight.data() + (first + s) * group_lanes + lane;
            const auto takes = hn::Lt(passed, hn::Set(di, size));
            const I row = hn::Min(passed, hn::Set(di, size - 1));
            const I at = hn::Add(hn::ShiftLeft<4>(row), hn::Iota(di, static_cast<std::int32_t>(lane)));
            const V f = hn::GatherIndex(d, batch.target, at);
            const I light = hn::GatherIndex(di, batch.light, row);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(d, takes), f, hn::LoadU(d, weight)), d, weight);
            hn::StoreU(hn::IfThenElse(takes, light, hn::LoadU(di, pick)), di, pick);
        };
        static_assert(group_lanes == 1 << 4);
        settle(0, passed0);
        if constexpr (count > 1) settle(1, passed1);
        if constexpr (count > 2) settle(2, passed2);
        if constexpr (count > 3) settle(3, passed3);
    }
}

// The same for a batch of few lights, without the gathers, which cost as much as twenty or so of them: a light that
// begins at or before the point is kept until a later one does, too.
template <int count>
HWY_INLINE void pass_few(const LightBatch& batch, GroupPicks& picks, int first, const float (&point)[4][group_lanes]) {
    const hn::CappedTag<float, group_lanes> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    using V = hn::Vec<decltype(d)>;
    using I = hn::Vec<decltype(di)>;
    for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
        const V p0 = hn::LoadU(d, point[0] + lane), p1 = hn::LoadU(d, point[1] + lane);
        const V p2 = hn::LoadU(d, point[2] + lane), p3 = hn::LoadU(d, point[3] + lane);
        V before = hn::Zero(d), f0 = before, f1 = before, f2 = before, f3 = before;
        I light0 = hn::Zero(di), light1 = light0, light2 = light0, light3 = light0;
        for (std::size_t i = 0; i < batch.size; ++i) {
            const V target = hn::LoadU(d, batch.target + i * group_lanes + lane);
            const I light = hn::Set(di, batch.light[i]);
            const auto meet = [&](V at, V& f, I& kept) HWY_ATTR {
                const auto begins = hn::Le(before, at);
                f = hn::IfThenElse(begins, target, f);
                kept = hn::IfThenElse(hn::RebindMask(di, begins), light, kept);
            };
            meet(p0, f0, light0);
            if constexpr (count > 1) meet(p1, f1, light1);
            if constexpr (count > 2) meet(p2, f2, light2);
            if constexpr (count > 3) meet(p3, f3, light3);
            before = hn::Add(before, target);
        }
        const auto settle = [&](int s, V at, V f, I light) HWY_ATTR {
            std::int32_t* pick = picks.light.data() + (first + s) * group_lanes + lane;
            float* weight = picks.weight.data() + (first + s) * group_lanes + lane;
            const auto passes = hn::Le(before, at);  // all of them
            hn::StoreU(hn::IfThenElse(passes, hn::LoadU(d, weight), f), d, weight);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(di, passes), hn::LoadU(di, pick), light), di, pick);
        };
        settle(0, p0, f0, light0);
        if constexpr (count > 1) settle(1, p1, f1, light1);
        if constexpr (count > 2) settle(2, p2, f2, light2);
        if constexpr (count > 3) settle(3, p3, f3, light3);
    }
}

template <int count>
HWY_INLINE void pass(const LightBatch& batch, GroupPicks& picks, int first, const float (&point)[4][group_lanes]) {
    if (batch.size <= 24)
        pass_few<count>(batch, picks, first, point);
    else
        pass_batch<count>(batch, picks, first, point);
}

HWY_INLINE void pick_by_reservoir(const LightBatch& batch, const PickSettings& settings, const std::uint32_t* pixel,
                                  GroupPicks& picks) {
    for (int first = 0; first < settings.samples; first += 4) {
        const std::uint32_t which = picks.batches * (max_shadow_samples / 4) + static_cast<std::uint32_t>(first / 4);
        float point[4][group_lanes];
#pragma omp simd
        for (int i = 0; i < group_lanes; ++i) {
            const Random4 r = random4(pixel[i], which, Stream::pick, settings.key);
            point[0][i] = reservoir_point(to_unit(r.x), picks.sum[i], batch.sum[i]);
            point[1][i] = reservoir_point(to_unit(r.y), picks.sum[i], batch.sum[i]);
            point[2][i] = reservoir_point(to_unit(r.z), picks.sum[i], batch.sum[i]);
            point[3][i] = reservoir_point(to_unit(r.w), picks.sum[i], batch.sum[i]);
        }
        switch (settings.samples - first) {
            case 1:
                pass<1>(batch, picks, first, point);
                break;
            case 2:
                pass<2>(batch, picks, first, point);
                break;
            case 3:
                pass<3>(batch, picks, first, point);
                break;
            default:
                pass<4>(batch, picks, first, point);
        }
    }
}

HWY_INLINE void pick_by_race(const LightBatch& batch, const PickSettings& settings, const std::uint32_t* pixel,
                             GroupPicks& picks) {
    for (int s = 0; s < settings.samples; ++s) {
        float* best = picks.key.data() + s * group_lanes;
        float* weight = picks.weight.data() + s * group_lanes;
        std::int32_t* pick = picks.light.data() + s * group_lanes;
        const std::uint32_t key = settings.key + static_cast<std::uint32_t>(s) * 0x9e3779b9u;
        for (std::size_t light = 0; light < batch.size; ++light) {
            const float* target = batch.target + light * group_lanes;
            const std::int32_t index = batch.light[light];
#pragma omp simd
            for (int i = 0; i < group_lanes; ++i) {
                const float f = target[i];
                const Random4 r = random4(pixel[i], static_cast<std::uint32_t>(index), Stream::race, key);
                const float mine = race_key(r.x, f);
                const bool wins = f > 0.0f && mine < best[i];
                best[i] = wins ? mine : best[i];
                weight[i] = wins ? f : weight[i];
                pick[i] = wins ? index : pick[i];
            }
        }
    }
}

HWY_INLINE void pick(const LightBatch& batch, const PickSettings& settings, const std::uint32_t* pixel,
                     GroupPicks& picks) {
    if (settings.picker == Picker::race)
        pick_by_race(batch, settings, pixel, picks);
    else
        pick_by_reservoir(batch, settings, pixel, picks);
    ++picks.batches;
    for (int i = 0; i < group_lanes; ++i) picks.sum[i] += batch.sum[i];
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
