// Where a shadow ray goes once a grid light is picked: to one of the input lights it is made of, or to a
// point jittered around its centre (LY19 3.3).
#pragma once

#include <cstdint>

#include "lab/random.h"
#include "lab/records.h"

namespace lab {

// An input light (merged index) drawn in proportion to its weight in `light` times its luminance.
std::uint32_t draw_member(const HierarchyView& hierarchy, std::uint32_t light, const Random4& random);

// Density (1 + cos(pi x)) / 2 on [-1, 1], from a uniform number in [0, 1).
float sample_raised_cosine(float u);

// centre + deviation_scale * pi * xi * deviation, xi a raised cosine per axis.
vec3 jittered_point(const HierarchyView& hierarchy, std::uint32_t light, float deviation_scale, const Random4& random);

}  // namespace lab
