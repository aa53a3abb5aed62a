// A group of pixels lit by a list of lights.
#if defined(LAB_LIGHT_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_LIGHT_LANES_H
#undef LAB_LIGHT_LANES_H
#else
#define LAB_LIGHT_LANES_H
#endif

#include "lab/pick_lanes.h"
#include "lab/receive_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

struct GroupSums {
    float red[group_lanes] = {}, green[group_lanes] = {}, blue[group_lanes] = {};
};

// Adds lights[list[0]], lights[list[1]], .. to the sums; where wanted, what each sends to each pixel is kept in
// `batch`, after targets that sum to `before`.
template <bool soft, bool clamped, bool keep>
HWY_INLINE void add_lights(const ReadyLight* lights, const std::uint32_t* list, std::size_t count, const PixelGroup& g,
                           float clamp_squared, bool importance, const float* before, GroupSums& sums,
                           LightBatch& batch) {
    const Lanes d;
    for (std::size_t lane = 0; lane < group_lanes; lane += hn::Lanes(d)) {
        const Vec px = hn::LoadU(d, g.px + lane), py = hn::LoadU(d, g.py + lane), pz = hn::LoadU(d, g.pz + lane);
        const Vec nx = hn::LoadU(d, g.nx + lane), ny = hn::LoadU(d, g.ny + lane), nz = hn::LoadU(d, g.nz + lane);
        const Vec clamp2 = all(clamp_squared);
        Vec red = hn::LoadU(d, sums.red + lane), green = hn::LoadU(d, sums.green + lane),
            blue = hn::LoadU(d, sums.blue + lane), sum = keep ? hn::LoadU(d, before + lane) : hn::Zero(d);
        for (std::size_t i = 0; i < count; ++i) {
            const ReadyLight& light = lights[list[i]];
            const Vec weight = receive_lanes<soft, clamped>(light, clamp2, px, py, pz, nx, ny, nz);
            red = hn::MulAdd(weight, all(light.intensity.x), red);
            green = hn::MulAdd(weight, all(light.intensity.y), green);
            blue = hn::MulAdd(weight, all(light.intensity.z), blue);
            if constexpr (keep) {
                Vec target = hn::Mul(weight, all(light.bright));
                if (!importance) target = hn::IfThenElseZero(hn::Gt(target, hn::Zero(d)), all(1.0f));
                sum = hn::Add(sum, target);
                hn::StoreU(target, d, batch.target + i * group_lanes + lane);
                if (lane == 0) batch.light[i] = static_cast<std::int32_t>(light.index);
            }
        }
        hn::StoreU(red, d, sums.red + lane);
        hn::StoreU(green, d, sums.green + lane);
        hn::StoreU(blue, d, sums.blue + lane);
        if constexpr (keep) hn::StoreU(sum, d, batch.after + lane);
    }
    batch.size = count;
}

// Lights a group by a whole list, batch after batch, and picks on the way. Shadow samples are picked anew from place
// `restart` of the list on (0: from its beginning). Calls each_batch(place of its first light), where `keep` is set or
// there is something to pick.
template <bool soft, bool clamped, class EachBatch>
HWY_INLINE void light_group(const ReadyLight* lights, const std::uint32_t* list, std::size_t count, std::size_t restart,
                            const PixelGroup& g, float clamp_squared, const PickSettings& settings, bool keep,
                            GroupSums& sums, GroupPicks& picks, LightBatch& batch, const EachBatch& each_batch) {
    if (settings.samples == 0 && !keep) {
        add_lights<soft, clamped, false>(lights, list, count, g, clamp_squared, true, picks.sum, sums, batch);
        return;
    }
    picks.clear(settings.picker);
    for (std::size_t first = 0, end; first < count; first = end) {
        if (first == restart && first > 0) picks.restart();
        end = std::min(first < restart ? restart : count, first + LightBatch::most);
        add_lights<soft, clamped, true>(lights, list + first, end - first, g, clamp_squared, settings.importance,
                                        picks.sum, sums, batch);
        each_batch(first);
        if (settings.samples > 0) pick(batch, settings, g.pixel, picks);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
