// One pass of the filters with a fixed tolerance: what it reads and writes.
#pragma once

#include "lab/filter_guides.h"
#include "lab/filter_strip.h"

namespace lab {

struct FilterPass {
    const Planes& in;        // numerators and denominators
    const Planes& value;     // 1 plane: the value that guides
    const Planes& surfaces;  // surface_guides
    Planes& out;
};

// atrous: 5 x 5 taps, weighed by one Gaussian of the distance in the space of (value, normal, position).
void atrous_strip(const FilterPass& pass, const Strip& strip, PairRows& pairs);

// A separable spatial kernel: the weights of taps -radius..radius.
struct SpatialKernel {
    std::vector<float> weight;

    int radius() const { return static_cast<int>(weight.size()) / 2; }
};

// bilateral: the same distance, any kernel.
void bilateral_line(const FilterPass& pass, const SpatialKernel& kernel, int y);

// atrous_plane: distance of q from p's tangent plane, in footprints of p at this pass's step; normals; value.
void plane_line(const FilterPass& pass, const SpatialKernel& kernel, int step, float per_normal, int y);

// How numerators and denominators make the guiding value: the shadow ratio, or what area lights send relative to
// `mean_area` where that is not 0; over its sigma.
struct ValueScale {
    int numerators;
    float mean_area, per_value;
};

// The guide's value of columns [x0, x1) of line y.
void take_values(const Planes& signal, const ValueScale& scale, int y, int x0, int x1, Planes& value);

}  // namespace lab
