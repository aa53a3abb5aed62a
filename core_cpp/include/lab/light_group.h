// Groups of pixels being lit, one SIMD lane a pixel, and the lights that may reach them.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/params.h"
#include "lab/ready_light.h"

namespace lab {

inline constexpr int group_lanes = 16;

// Where a group's points lie and where they look. Every point p with normal n keeps to these:
//   |p - centre| <= extent on each axis, |n - normal| <= spread, normal . (centre - p) <= slab.
struct GroupBounds {
    vec3 centre, extent, normal;
    float spread, slab;

    float radius() const { return glm::length(extent); }
};

struct alignas(64) PixelGroup {
    float px[group_lanes], py[group_lanes], pz[group_lanes], nx[group_lanes], ny[group_lanes], nz[group_lanes];
    std::uint32_t pixel[group_lanes];  // rows of the G-buffer
    std::uint32_t lanes;               // bit i: lane i holds a pixel; others repeat one, and are not read
};

inline constexpr std::uint32_t every_lane = (1u << group_lanes) - 1;

// Lights in structure-of-arrays form, so that many can be tested against one group at once.
class LightColumns {
  public:
    enum Column { x, y, z, mean_x, mean_y, mean_z, xx, yy, zz, xy, xz, yz, steepness, inner, outer, columns };
    static constexpr std::size_t vector = group_lanes;

    std::size_t size() const { return count_; }
    // Makes room for `count` lights, which are to be set. Whole vectors may be read and written past the last, too.
    void resize(std::size_t count);
    void set(std::size_t i, const ReadyLight& light, std::uint32_t slot);
    const float* operator[](int column) const { return values_.data() + column * capacity_; }
    float* operator[](int column) { return values_.data() + column * capacity_; }
    // Where each light is kept.
    const std::uint32_t* slots() const { return slot_.data(); }
    std::uint32_t* slots() { return slot_.data(); }

  private:
    std::size_t count_ = 0, capacity_ = 0;
    Buffer<float> values_;
    Buffer<std::uint32_t> slot_;
};

}  // namespace lab
