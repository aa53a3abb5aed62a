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
    int count;                         // lanes past it repeat the last pixel, and are not read
    GroupBounds bounds;
};

// Lights in structure-of-arrays form, so that many can be tested against one group at once.
class LightColumns {
  public:
    enum Column { x, y, z, mean_x, mean_y, mean_z, xx, yy, zz, xy, xz, yz, steepness, inner, outer, columns };

    std::size_t size() const { return count_; }
    void clear() { count_ = 0; }
    // `slot`: where the light is kept.
    void push(const ReadyLight& light, std::uint32_t slot);
    // As the lights `rows` of `from`.
    void assign(const LightColumns& from, const std::uint32_t* rows, std::size_t count);
    // Whole vectors may be read, past the last light, too.
    const float* operator[](Column c) const { return values_.data() + c * capacity_; }
    std::uint32_t slot(std::size_t i) const { return slot_[i]; }

  private:
    static constexpr std::size_t vector = 16;
    std::size_t count_ = 0, capacity_ = 0;
    std::vector<float> values_;
    std::vector<std::uint32_t> slot_;

    void reserve(std::size_t count);
};

}  // namespace lab
