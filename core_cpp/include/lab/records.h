// The records of lab/records.py as the C++ core sees them: views of arrays that Python owns.
// Shapes: H x W pixels, m merged grid lights, L levels, k shadow samples; vectors are glm::vec3.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "lab/alias_table.h"

namespace lab {

using glm::vec3;

// Six numbers of a symmetric matrix: xx yy zz xy xz yz.
struct Symmetric {
    float xx, yy, zz, xy, xz, yz;
};

struct Vertex {
    std::uint16_t x, y, z;
};

struct LightsView {
    std::span<const vec3> position, flux, normal;
};

struct MembersView {
    std::span<const std::int64_t> offset;
    std::span<const AliasSlot> slot;
};

struct HierarchyView {
    vec3 origin;
    std::span<const float> cell_size;
    std::span<const std::int64_t> offset;
    std::span<const vec3> position, flux, normal;
    std::span<const Symmetric> normal_moment;
    std::span<const vec3> deviation;
    std::span<const Vertex> vertex;
    std::span<const std::uint8_t> oriented;
    std::span<const std::uint32_t> input_index;
    MembersView members;

    int top() const { return static_cast<int>(cell_size.size()) - 1; }
};

struct GBufferView {
    int width, height;
    std::span<const vec3> position, normal, geometric_normal, albedo, emission;
    std::span<const float> depth;
    float pixel_angle;

    std::size_t pixels() const { return depth.size(); }
};

struct LightingView {
    std::span<const vec3> irradiance;
    std::span<const std::int32_t> light;
    std::span<const float> target_weight, weight_sum;
};

}  // namespace lab
