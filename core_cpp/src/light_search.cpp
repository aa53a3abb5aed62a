#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/light_search.cpp"
#include <hwy/foreach_target.h>

#include "lab/light_block.h"
//
#include "lab/receive_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// Boxes around some of a block's clusters each, one a lane: most lights in the box around all are far from every
// surface that the block sees.
struct Boxes {
    float low_x[group_lanes], low_y[group_lanes], low_z[group_lanes];
    float high_x[group_lanes], high_y[group_lanes], high_z[group_lanes];
    Box all;

    // Clusters [0, count), in runs of neighbours.
    Boxes(const std::vector<Cluster>& clusters, std::size_t count) {
        constexpr float most = std::numeric_limits<float>::max();
        all = {vec3(most), vec3(-most)};
        const std::size_t run = (count + group_lanes - 1) / group_lanes;
        for (std::size_t i = 0; i < group_lanes; ++i) {
            Box box{vec3(most), vec3(-most)};  // a lane without clusters is reached from nowhere
            for (std::size_t c = i * run; c < std::min(count, (i + 1) * run); ++c) {
                const GroupBounds& b = clusters[c].bounds;
                box.low = glm::min(box.low, b.centre - b.extent);
                box.high = glm::max(box.high, b.centre + b.extent);
            }
            set(i, box);
        }
    }

    void set(std::size_t i, const Box& box) {
        low_x[i] = box.low.x;
        low_y[i] = box.low.y;
        low_z[i] = box.low.z;
        high_x[i] = box.high.x;
        high_y[i] = box.high.y;
        high_z[i] = box.high.z;
        all.low = glm::min(all.low, box.low);
        all.high = glm::max(all.high, box.high);
    }

    // Whether a light at p reaches any box, its distances being from `inner` to `outer`.
    HWY_INLINE bool reached(const vec3& p, float inner2, float outer2) const {
        const Lanes d;
        const Vec x = HWY_NAMESPACE::all(p.x), y = HWY_NAMESPACE::all(p.y), z = HWY_NAMESPACE::all(p.z);
        const Vec zero = hn::Zero(d);
        for (std::size_t i = 0; i < group_lanes; i += hn::Lanes(d)) {
            const Vec ax = hn::Sub(hn::LoadU(d, low_x + i), x), bx = hn::Sub(x, hn::LoadU(d, high_x + i));
            const Vec ay = hn::Sub(hn::LoadU(d, low_y + i), y), by = hn::Sub(y, hn::LoadU(d, high_y + i));
            const Vec az = hn::Sub(hn::LoadU(d, low_z + i), z), bz = hn::Sub(z, hn::LoadU(d, high_z + i));
            const Vec nx = hn::Max(zero, hn::Max(ax, bx)), ny = hn::Max(zero, hn::Max(ay, by)),
                      nz = hn::Max(zero, hn::Max(az, bz));
            const Vec fx = hn::Min(ax, bx), fy = hn::Min(ay, by), fz = hn::Min(az, bz);
            const auto in_range = hn::And(hn::Le(dot(nx, ny, nz, nx, ny, nz), HWY_NAMESPACE::all(outer2)),
                                          hn::Ge(dot(fx, fy, fz, fx, fy, fz), HWY_NAMESPACE::all(inner2)));
            if (!hn::AllFalse(d, in_range)) return true;
        }
        return false;
    }
};

void find_lights(const LightFrame& frame, bool cubes, BlockScratch& s) {
    const HierarchyView& h = frame.hierarchy;
    constexpr float slack = 1e-5f;
    const Boxes boxes(s.clusters, s.patches.back().end);
    s.found.clear();
    for (int level = frame.settings.first_level; level <= h.top(); ++level) {
        const float outer = 2 * blend_radius(h, level, frame.settings);
        const float inner = level > frame.settings.first_level ? 0.25f * outer : 0.0f;
        const float outer2 = level == h.top() ? std::numeric_limits<float>::infinity() : outer * outer * (1 + slack);
        const float inner2 = inner * inner * (1 - slack);
        const auto visit = [&](std::uint32_t i) HWY_ATTR {
            if (cubes || boxes.reached(h.position[i], inner2, outer2)) s.found.push_back(i);
        };
        if (level == h.top())
            for (std::int64_t i = h.offset[level]; i < h.offset[level + 1]; ++i) visit(static_cast<std::uint32_t>(i));
        else
            frame.rows[level].find({boxes.all.low - outer, boxes.all.high + outer}, visit);
    }
    s.lights.resize(s.found.size());
    s.in_block.resize(s.found.size());
    int level = 0;
    for (std::size_t i = 0; i < s.found.size(); ++i) {
        while (s.found[i] >= h.offset[level + 1]) ++level;
        s.lights[i] = frame.lights.of(s.found[i], level);
        s.in_block.set(i, s.lights[i], static_cast<std::uint32_t>(i));
    }
    if (frame.tile_of.empty()) return;
    s.tile_of.resize(s.found.size());
    for (std::size_t i = 0; i < s.found.size(); ++i) s.tile_of[i] = frame.tile_of[s.found[i]];
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(find_lights);

void find_lights(const LightFrame& frame, bool cubes, BlockScratch& scratch) {
    HWY_DYNAMIC_DISPATCH(find_lights)(frame, cubes, scratch);
}

}  // namespace lab
#endif
