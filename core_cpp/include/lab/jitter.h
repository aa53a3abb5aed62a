// Points jittered around the centre of a grid light, where the paper's shadow rays go (LY19 3.3).
#pragma once

#include <cstdint>

#include "lab/random.h"
#include "lab/records.h"

namespace lab {

// Density (1 + cos(pi x)) / 2 on [-1, 1], from a uniform number in [0, 1).
float sample_raised_cosine(float u);

// centre + deviation_scale * pi * xi * deviation, xi a raised cosine per axis.
vec3 jittered_point(const HierarchyView& hierarchy, std::uint32_t light, float deviation_scale, const Random4& random);

}  // namespace lab
