// Which lights may send anything to a group of pixels: lights are the lanes here.
#if defined(LAB_CULL_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_CULL_LANES_H
#undef LAB_CULL_LANES_H
#else
#define LAB_CULL_LANES_H
#endif

#include <span>

#include "lab/receive_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// Calls take(first of a vector of lights, which of them) for those lights, ascending. A light is left out only where
// surely nothing of it arrives, whatever the rounding.
template <class Take>
HWY_INLINE void cull(const GroupBounds& b, const LightColumns& lights, const Take& take) {
    using C = LightColumns;
    const Lanes d;
    const std::size_t step = hn::Lanes(d);
    constexpr float slack = 1e-5f;
    const Vec zero = hn::Zero(d);
    const Vec cx = all(b.centre.x), cy = all(b.centre.y), cz = all(b.centre.z);
    const Vec ex = all(b.extent.x), ey = all(b.extent.y), ez = all(b.extent.z);
    const Vec nx = all(b.normal.x), ny = all(b.normal.y), nz = all(b.normal.z);
    const Vec spread = all(b.spread + 2 * slack), slab = all(b.slab), radius = all(b.radius());
    const Vec more = all(1 + slack), less = all(1 - slack);
    for (std::size_t i = 0; i < lights.size(); i += step) {
        const auto column = [&](C::Column c) HWY_ATTR { return hn::LoadU(d, lights[c] + i); };
        // To the light from the centre, and the least and most that any point of the group makes of it.
        const Vec vx = hn::Sub(column(C::x), cx), vy = hn::Sub(column(C::y), cy), vz = hn::Sub(column(C::z), cz);
        const Vec ax = hn::Abs(vx), ay = hn::Abs(vy), az = hn::Abs(vz);
        const Vec least_x = hn::Max(zero, hn::Sub(ax, ex)), least_y = hn::Max(zero, hn::Sub(ay, ey)),
                  least_z = hn::Max(zero, hn::Sub(az, ez));
        const Vec most_x = hn::Add(ax, ex), most_y = hn::Add(ay, ey), most_z = hn::Add(az, ez);
        const Vec least2 = dot(least_x, least_y, least_z, least_x, least_y, least_z);
        const Vec most2 = dot(most_x, most_y, most_z, most_x, most_y, most_z);
        const Vec inner = column(C::inner), outer = column(C::outer);
        const auto in_range = hn::And(hn::Le(least2, hn::Mul(hn::Mul(outer, outer), more)),
                                      hn::Ge(most2, hn::Mul(hn::Mul(inner, inner), less)));
        if (hn::AllFalse(d, in_range)) continue;  // neighbours in the list are neighbours in space
        // How far the light rises above the receivers' horizon, at most.
        const Vec most = hn::Mul(root(most2), more);
        const Vec above = hn::Add(dot(nx, ny, nz, vx, vy, vz), hn::MulAdd(spread, most, slab));
        // What the lobe sends to the centre, and how much more it can send elsewhere.
        const Vec square = square_along(column(C::xx), column(C::yy), column(C::zz), column(C::xy), column(C::xz),
                                        column(C::yz), vx, vy, vz);
        const Vec along = dot(column(C::mean_x), column(C::mean_y), column(C::mean_z), vx, vy, vz);
        const Vec sent = hn::Sub(hn::Mul(root(hn::Max(zero, square)), more), along);
        const Vec sends = hn::MulAdd(column(C::steepness), hn::MulAdd(all(2 * slack), most, radius), sent);
        auto sees = hn::And(in_range, hn::And(hn::Ge(above, zero), hn::Ge(sends, zero)));
        if (i + step > lights.size()) sees = hn::And(sees, hn::FirstN(d, lights.size() - i));
        take(i, sees);
    }
}

// Writes the slots of those lights and returns their number. Whole vectors are written.
HWY_INLINE std::size_t cull_into(const GroupBounds& bounds, const LightColumns& lights, std::uint32_t* kept) {
    const hn::RebindToUnsigned<Lanes> du;
    std::size_t count = 0;
    cull(bounds, lights, [&](std::size_t i, auto sees) HWY_ATTR {
        const auto seen = hn::RebindMask(du, sees);
        hn::StoreU(hn::Compress(hn::LoadU(du, lights.slots() + i), seen), du, kept + count);
        count += hn::CountTrue(du, seen);
    });
    return count;
}

// Keeps those lights alone, for what lies within the same bounds.
HWY_INLINE void cull_into(const GroupBounds& bounds, const LightColumns& lights, LightColumns& kept) {
    const Lanes d;
    const hn::RebindToUnsigned<Lanes> du;
    kept.resize(lights.size());
    std::size_t count = 0;
    cull(bounds, lights, [&](std::size_t i, auto sees) HWY_ATTR {
        for (int c = 0; c < LightColumns::columns; ++c)
            hn::StoreU(hn::Compress(hn::LoadU(d, lights[c] + i), sees), d, kept[c] + count);
        const auto seen = hn::RebindMask(du, sees);
        hn::StoreU(hn::Compress(hn::LoadU(du, lights.slots() + i), seen), du, kept.slots() + count);
        count += hn::CountTrue(du, seen);
    });
    kept.resize(count);
}

// Of a list of lights, writes those that reach some pixel of the group by distance and horizon, and returns their
// number. Pixels are the lanes here: worth it where they lie so far apart that many lights reach their box alone.
template <bool soft>
HWY_INLINE std::size_t cull_exactly(const PixelGroup& g, const ReadyLight* lights, std::span<const std::uint32_t> list,
                                    std::uint32_t* kept) {
    const Lanes d;
    std::size_t count = 0;
    for (const std::uint32_t slot : list) {
        const ReadyLight& light = lights[slot];
        const Vec x = all(light.position.x), y = all(light.position.y), z = all(light.position.z);
        const Vec least = all(light.least2), most = all(light.most2);
        bool reaches = false;
        for (std::size_t i = 0; i < group_lanes; i += hn::Lanes(d)) {
            const Vec vx = hn::Sub(x, hn::LoadU(d, g.px + i)), vy = hn::Sub(y, hn::LoadU(d, g.py + i)),
                      vz = hn::Sub(z, hn::LoadU(d, g.pz + i));
            const Vec d2 = dot(vx, vy, vz, vx, vy, vz);
            auto sees = hn::And(hn::Ge(d2, least), hn::Le(d2, most));
            if constexpr (!soft) {
                const Vec nx = hn::LoadU(d, g.nx + i), ny = hn::LoadU(d, g.ny + i), nz = hn::LoadU(d, g.nz + i);
                sees = hn::And(sees, hn::Gt(dot(nx, ny, nz, vx, vy, vz), hn::Zero(d)));
            }
            reaches |= !hn::AllFalse(d, sees);
        }
        kept[count] = slot;
        count += reaches;
    }
    return count;
}

HWY_INLINE float least_of(const float* lanes) {
    const Lanes d;
    Vec least = hn::LoadU(d, lanes);
    for (std::size_t i = hn::Lanes(d); i < group_lanes; i += hn::Lanes(d))
        least = hn::Min(least, hn::LoadU(d, lanes + i));
    return hn::GetLane(hn::MinOfLanes(d, least));
}

// Bounds of the points and normals of several groups.
HWY_INLINE GroupBounds bounds_of(const PixelGroup* begin, std::size_t count) {
    const PixelGroup* const end = begin + count;
    using Row = float (PixelGroup::*)[group_lanes];
    constexpr Row position[3] = {&PixelGroup::px, &PixelGroup::py, &PixelGroup::pz};
    constexpr Row direction[3] = {&PixelGroup::nx, &PixelGroup::ny, &PixelGroup::nz};
    constexpr float most = std::numeric_limits<float>::max();
    const Lanes d;
    const auto range = [&](Row row) HWY_ATTR {
        Vec low = all(most), high = all(-most);
        for (const PixelGroup* g = begin; g != end; ++g) {
            if (g->lanes == 0) continue;
            for (std::size_t i = 0; i < group_lanes; i += hn::Lanes(d)) {
                const Vec value = hn::LoadU(d, g->*row + i);
                low = hn::Min(low, value);
                high = hn::Max(high, value);
            }
        }
        return std::pair(hn::GetLane(hn::MinOfLanes(d, low)), hn::GetLane(hn::MaxOfLanes(d, high)));
    };
    GroupBounds b;
    vec3 normal;
    for (int a = 0; a < 3; ++a) {
        const auto [low, high] = range(position[a]);
        b.centre[a] = 0.5f * (low + high);
        b.extent[a] = larger(high - b.centre[a], b.centre[a] - low);
        const auto [least, greatest] = range(direction[a]);
        normal[a] = least + greatest;
    }
    const float length = glm::length(normal);
    b.normal = length > 1e-3f ? normal / length : normal;
    const Vec nx = all(b.normal.x), ny = all(b.normal.y), nz = all(b.normal.z);
    const Vec cx = all(b.centre.x), cy = all(b.centre.y), cz = all(b.centre.z);
    Vec spread2 = hn::Zero(d), slab = all(-most);
    for (const PixelGroup* g = begin; g != end; ++g) {
        if (g->lanes == 0) continue;
        for (std::size_t i = 0; i < group_lanes; i += hn::Lanes(d)) {
            const Vec sx = hn::Sub(hn::LoadU(d, g->nx + i), nx), sy = hn::Sub(hn::LoadU(d, g->ny + i), ny),
                      sz = hn::Sub(hn::LoadU(d, g->nz + i), nz);
            spread2 = hn::Max(spread2, dot(sx, sy, sz, sx, sy, sz));
            const Vec vx = hn::Sub(cx, hn::LoadU(d, g->px + i)), vy = hn::Sub(cy, hn::LoadU(d, g->py + i)),
                      vz = hn::Sub(cz, hn::LoadU(d, g->pz + i));
            slab = hn::Max(slab, dot(nx, ny, nz, vx, vy, vz));
        }
    }
    b.spread = std::sqrt(hn::GetLane(hn::MaxOfLanes(d, spread2)));
    b.slab = hn::GetLane(hn::MaxOfLanes(d, slab));
    return b;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
