// Which lights may send anything to a group of pixels: lights are the lanes here.
#if defined(LAB_CULL_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_CULL_LANES_H
#undef LAB_CULL_LANES_H
#else
#define LAB_CULL_LANES_H
#endif

#include "lab/receive_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// Writes the rows of those lights, ascending, and returns their number. A light is left out only where surely nothing
// of it arrives, whatever the rounding. Whole vectors are written to `kept`.
HWY_INLINE std::size_t cull(const GroupBounds& b, const LightColumns& lights, std::uint32_t* kept) {
    using C = LightColumns;
    const Lanes d;
    const hn::RebindToUnsigned<Lanes> du;
    const std::size_t step = hn::Lanes(d);
    constexpr float slack = 1e-5f;
    const Vec zero = hn::Zero(d);
    const Vec cx = all(b.centre.x), cy = all(b.centre.y), cz = all(b.centre.z);
    const Vec ex = all(b.extent.x), ey = all(b.extent.y), ez = all(b.extent.z);
    const Vec nx = all(b.normal.x), ny = all(b.normal.y), nz = all(b.normal.z);
    const Vec spread = all(b.spread + 2 * slack), slab = all(b.slab), radius = all(b.radius());
    const Vec more = all(1 + slack), less = all(1 - slack);
    std::size_t count = 0;
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
        const auto rows = hn::Iota(du, static_cast<std::uint32_t>(i));
        const auto seen = hn::RebindMask(du, sees);
        hn::StoreU(hn::Compress(rows, seen), du, kept + count);
        count += hn::CountTrue(du, seen);
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

HWY_INLINE float most_of(const float* lanes) {
    const Lanes d;
    Vec most = hn::LoadU(d, lanes);
    for (std::size_t i = hn::Lanes(d); i < group_lanes; i += hn::Lanes(d))
        most = hn::Max(most, hn::LoadU(d, lanes + i));
    return hn::GetLane(hn::MaxOfLanes(d, most));
}

// Bounds of a group's points and normals.
HWY_INLINE GroupBounds bounds_of(const PixelGroup& g) {
    const Lanes d;
    GroupBounds b;
    const float *p[3] = {g.px, g.py, g.pz}, *n[3] = {g.nx, g.ny, g.nz};
    vec3 normal;
    for (int a = 0; a < 3; ++a) {
        const float low = least_of(p[a]), high = most_of(p[a]);
        b.centre[a] = 0.5f * (low + high);
        b.extent[a] = larger(high - b.centre[a], b.centre[a] - low);
        normal[a] = least_of(n[a]) + most_of(n[a]);
    }
    const float length = glm::length(normal);
    b.normal = length > 1e-3f ? normal / length : normal;
    Vec spread2 = hn::Zero(d), slab = all(std::numeric_limits<float>::lowest());
    for (int i = 0; i < group_lanes; i += static_cast<int>(hn::Lanes(d))) {
        const Vec nx = all(b.normal.x), ny = all(b.normal.y), nz = all(b.normal.z);
        const Vec sx = hn::Sub(hn::LoadU(d, g.nx + i), nx), sy = hn::Sub(hn::LoadU(d, g.ny + i), ny),
                  sz = hn::Sub(hn::LoadU(d, g.nz + i), nz);
        spread2 = hn::Max(spread2, dot(sx, sy, sz, sx, sy, sz));
        const Vec vx = hn::Sub(all(b.centre.x), hn::LoadU(d, g.px + i)),
                  vy = hn::Sub(all(b.centre.y), hn::LoadU(d, g.py + i)),
                  vz = hn::Sub(all(b.centre.z), hn::LoadU(d, g.pz + i));
        slab = hn::Max(slab, dot(nx, ny, nz, vx, vy, vz));
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
