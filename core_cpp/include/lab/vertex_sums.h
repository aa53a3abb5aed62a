// What a grid vertex accumulates from the lights around it (LY19 3.1).
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

#include "lab/records.h"

namespace lab {

// Input lights are summed in 64-bit fixed point: integer sums don't depend on order, so S1 is bit-identical for any
// thread count and order of the lights. Every term is at most 1 in magnitude: ten million lights stay under 2^56, and
// 2^31 of them still fit. The other side of it: light under 2^-32 of the brightest light's is lost from S1 up.
// Gathered levels are summed in double, in a fixed order.
struct FixedPoint {
    using Sum = std::int64_t;
    static Sum term(float x) { return std::llrint(static_cast<double>(x) * 0x1p32); }
    static double value(Sum sum) { return static_cast<double>(sum) * 0x1p-32; }
};

struct FloatingPoint {
    using Sum = double;
    static Sum term(double x) { return x; }
    static double value(Sum sum) { return sum; }
};

// One light as its vertices see it. Flux is relative to the set's scale, lengths are in cells.
struct SourceLight {
    glm::vec3 flux;
    float weight;     // trilinear weight gathered so far: 1 for an input light
    float luminance;  // of flux
    glm::vec3 normal;
    Symmetric normal_moment;
    glm::vec3 variance;  // of position, inside the light itself, in cells squared
    bool oriented;
};

template <class Number>
struct VertexSums {
    using Sum = typename Number::Sum;
    Sum weight{}, flux[3]{}, moment_weight{}, position[3]{}, square[3]{}, normal[3]{}, normal_moment[6]{};
    bool oriented = false;

    bool kept() const { return flux[0] > 0 || flux[1] > 0 || flux[2] > 0; }

    void add_flux(const SourceLight& light, float w) {
        for (int c = 0; c < 3; ++c) flux[c] += Number::term(w * light.flux[c]);
    }

    // `offset`: the light relative to the vertex, in cells. Moments are weighted by luminance, or by weight
    // alone.
    void add(const SourceLight& light, float w, const glm::vec3& offset, bool by_luminance) {
        add_flux(light, w);
        weight += Number::term(w * light.weight);
        const float m = w * (by_luminance ? light.luminance : light.weight);
        const Sum counts = Number::term(m);
        moment_weight += counts;
        for (int c = 0; c < 3; ++c) {
            position[c] += Number::term(m * offset[c]);
            square[c] += Number::term(m * (offset[c] * offset[c] + light.variance[c]));
            normal[c] += Number::term(m * light.normal[c]);
        }
        const Symmetric& M = light.normal_moment;
        const float terms[6] = {M.xx, M.yy, M.zz, M.xy, M.xz, M.yz};
        for (int c = 0; c < 6; ++c) normal_moment[c] += Number::term(m * terms[c]);
        oriented = oriented || (light.oriented && counts > 0);
    }
};

}  // namespace lab
