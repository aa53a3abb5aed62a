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

// `count` reservoirs, from `first`, pass by a batch. `record`: the last of each below the sum with the batch; where it
// lies before the batch the pick stays.
template <int count>
HWY_INLINE void pass_batch(const LightBatch& batch, GroupPicks& picks, int first,
                           const float (&record)[4][group_lanes]) {
    const hn::CappedTag<float, group_lanes> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    using V = hn::Vec<decltype(d)>;
    using I = hn::Vec<decltype(di)>;
    const auto size = static_cast<std::int32_t>(batch.size);
    for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
        // Each on its own: arrays of vectors are not for every instruction set.
        const V p0 = hn::LoadU(d, record[0] + lane), p1 = hn::LoadU(d, record[1] + lane);
        const V p2 = hn::LoadU(d, record[2] + lane), p3 = hn::LoadU(d, record[3] + lane);
        I passed0 = hn::Zero(di), passed1 = passed0, passed2 = passed0, passed3 = passed0, number = passed0;
        const I one = hn::Set(di, 1);
        const V before = hn::LoadU(d, picks.sum + lane);
        V after = before;
        const auto pass = [&](V at, I passed) HWY_ATTR {
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
        const auto settle = [&](int s, V last, I passed) HWY_ATTR {
            std::int32_t* pick = picks.light.data() + (first + s) * group_lanes + lane;
            float* weight = picks.weight.data() + (first + s) * group_lanes + lane;
            const auto takes = hn::And(hn::Lt(passed, hn::Set(di, size)), hn::RebindMask(di, hn::Ge(last, before)));
            const I row = hn::Min(passed, hn::Set(di, size - 1));
            const I at = hn::Add(hn::ShiftLeft<4>(row), hn::Iota(di, static_cast<std::int32_t>(lane)));
            const V f = hn::GatherIndex(d, batch.target, at);
            const I light = hn::GatherIndex(di, batch.light, row);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(d, takes), f, hn::LoadU(d, weight)), d, weight);
            hn::StoreU(hn::IfThenElse(takes, light, hn::LoadU(di, pick)), di, pick);
        };
        static_assert(group_lanes == 1 << 4);
        settle(0, p0, passed0);
        if constexpr (count > 1) settle(1, p1, passed1);
        if constexpr (count > 2) settle(2, p2, passed2);
        if constexpr (count > 3) settle(3, p3, passed3);
    }
}

// The same for a batch of few lights, without the gathers, which cost as much as twenty or so of them: a light that
// begins at or before the point is kept until a later one does, too.
template <int count>
HWY_INLINE void pass_few(const LightBatch& batch, GroupPicks& picks, int first, const float (&record)[4][group_lanes]) {
    const hn::CappedTag<float, group_lanes> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    using V = hn::Vec<decltype(d)>;
    using I = hn::Vec<decltype(di)>;
    for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
        const V p0 = hn::LoadU(d, record[0] + lane), p1 = hn::LoadU(d, record[1] + lane);
        const V p2 = hn::LoadU(d, record[2] + lane), p3 = hn::LoadU(d, record[3] + lane);
        const V first_begins = hn::LoadU(d, picks.sum + lane);
        V before = first_begins, f0 = hn::Zero(d), f1 = f0, f2 = f0, f3 = f0;
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
            const auto takes = hn::And(hn::Le(first_begins, at), hn::Lt(at, before));
            hn::StoreU(hn::IfThenElse(takes, f, hn::LoadU(d, weight)), d, weight);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(di, takes), light, hn::LoadU(di, pick)), di, pick);
        };
        settle(0, p0, f0, light0);
        if constexpr (count > 1) settle(1, p1, f1, light1);
        if constexpr (count > 2) settle(2, p2, f2, light2);
        if constexpr (count > 3) settle(3, p3, f3, light3);
    }
}

template <int count>
HWY_INLINE void pass(const LightBatch& batch, GroupPicks& picks, int first, const float (&record)[4][group_lanes]) {
    if (batch.size <= 24)
        pass_few<count>(batch, picks, first, record);
    else
        pass_batch<count>(batch, picks, first, record);
}

// last_record() of `count` samples of every lane. All step downward in turn, so that none waits for its own last step,
// until each has found its record.
HWY_INLINE void last_records(const float* below, const std::uint32_t (&seed)[4][group_lanes], int count,
                             float (&record)[4][group_lanes]) {
    const hn::CappedTag<float, group_lanes> d;
    const hn::Rebind<std::uint32_t, decltype(d)> du;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    using V = hn::Vec<decltype(d)>;
    using U = hn::Vec<decltype(du)>;
    const auto start = [&](U its_seed, U octave)
                           HWY_ATTR { return hn::Add(its_seed, hn::Mul(octave, hn::Set(du, 0x9e3779b9u))); };
    std::uint32_t octave[4][group_lanes], state[4][group_lanes];
    float share[4][group_lanes];
    for (int s = 0; s < count; ++s)
        for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
            const V sum = hn::LoadU(d, below + lane);
            const U its_octave = hn::ShiftRight<23>(hn::BitCast(du, sum));
            hn::StoreU(its_octave, du, octave[s] + lane);
            hn::StoreU(start(hn::LoadU(du, seed[s] + lane), its_octave), du, state[s] + lane);
            hn::StoreU(hn::Set(d, 2.0f), d, share[s] + lane);
            hn::StoreU(hn::IfThenElseZero(hn::Gt(sum, hn::Zero(d)), hn::Set(d, -1.0f)), d, record[s] + lane);
        }
    for (bool searching = true; searching;) {
        searching = false;
        for (int s = 0; s < count; ++s)
            for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
                const V sum = hn::LoadU(d, below + lane);
                const U from = hn::LoadU(du, octave[s] + lane);
                const U next_state = hn::Add(hn::Mul(hn::LoadU(du, state[s] + lane), hn::Set(du, 747796405u)),
                                             hn::Set(du, 2891336453u));  // pcg
                const U shift = hn::Add(hn::ShiftRight<28>(next_state), hn::Set(du, 4));
                const U word = hn::Mul(hn::Xor(hn::Shr(next_state, shift), next_state), hn::Set(du, 277803737u));
                const U bits = hn::ShiftRight<8>(hn::Xor(hn::ShiftRight<22>(word), word));
                const V unit = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, bits)), hn::Set(d, 0x1p-24f));
                const V next_share = hn::Mul(hn::LoadU(d, share[s] + lane), unit);
                const auto leaves = hn::Lt(next_share, hn::Set(d, 1.0f));
                const auto leaves_too = hn::RebindMask(du, leaves);
                const U to = hn::Sub(from, hn::IfThenElseZero(leaves_too, hn::Set(du, 1)));
                const V here = hn::Mul(next_share, hn::BitCast(d, hn::ShiftLeft<23>(from)));
                const V end = hn::IfThenElseZero(hn::RebindMask(d, hn::Gt(to, hn::Zero(du))), hn::Set(d, -1.0f));
                const V now = hn::IfThenElse(hn::AndNot(leaves, hn::Lt(here, sum)), here, end);
                const V before = hn::LoadU(d, record[s] + lane);
                const V found = hn::IfThenElse(hn::Lt(before, hn::Zero(d)), now, before);
                searching |= !hn::AllFalse(d, hn::Lt(found, hn::Zero(d)));
                hn::StoreU(found, d, record[s] + lane);
                hn::StoreU(to, du, octave[s] + lane);
                hn::StoreU(hn::IfThenElse(leaves_too, start(hn::LoadU(du, seed[s] + lane), to), next_state), du,
                           state[s] + lane);
                hn::StoreU(hn::IfThenElse(leaves, hn::Set(d, 2.0f), next_share), d, share[s] + lane);
            }
    }
}

HWY_INLINE void pick_by_reservoir(const LightBatch& batch, const PickSettings& settings, const std::uint32_t* pixel,
                                  GroupPicks& picks) {
    for (int first = 0; first < settings.samples; first += 4) {
        const int count = std::min(settings.samples - first, 4);
        std::uint32_t seed[4][group_lanes];
#pragma omp simd
        for (int i = 0; i < group_lanes; ++i) {
            const Random4 r = random4(pixel[i], static_cast<std::uint32_t>(first / 4), Stream::pick, settings.key);
            seed[0][i] = r.x;
            seed[1][i] = r.y;
            seed[2][i] = r.z;
            seed[3][i] = r.w;
        }
        float record[4][group_lanes];
        last_records(batch.after, seed, count, record);
        switch (count) {
            case 1:
                pass<1>(batch, picks, first, record);
                break;
            case 2:
                pass<2>(batch, picks, first, record);
                break;
            case 3:
                pass<3>(batch, picks, first, record);
                break;
            default:
                pass<4>(batch, picks, first, record);
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
    std::copy_n(batch.after, group_lanes, picks.sum);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
