// Picking shadow samples from a stream of lights (LY19 3.3, appendix A).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "lab/select.h"

namespace lab {

// The reservoir takes lights in batches, of one or of many. Lay a batch of weight `batch` on a line from 0, light after
// light, and all that came before, of weight `before`, behind it: the uniform falls on a point of that line. Within the
// batch it says which light replaces the pick (each with the probability that the paper's one-by-one decisions give
// it), beyond it the pick stays. Each batch has its own uniform.
inline float reservoir_point(float uniform, float before, float batch) {
    return uniform * (before + batch);
}

// Walks along a batch: `after` is the weight up to and with light number `number` - 1. The first light that ends
// beyond the point is the one; where none does, `passed` comes to the batch's size.
inline void reservoir_pass(float point, float after, std::int32_t number, std::int32_t& passed) {
    passed = after <= point ? number : passed;
}

// ln(x) for x in (0, 1): exponent and an atanh series, error under 1e-7, the same on every engine.
inline float natural_log(float x) {
    std::uint32_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    const std::uint32_t shifted = bits - 0x3f3504f3u;  // so that the mantissa lies in [sqrt(1/2), sqrt(2))
    const auto exponent = static_cast<std::int32_t>(shifted) >> 23;
    bits = (shifted & 0x007fffffu) + 0x3f3504f3u;
    float m;
    std::memcpy(&m, &bits, sizeof m);
    const float s = (m - 1.0f) / (m + 1.0f), s2 = s * s;
    const float series = 1.0f + s2 * (1.0f / 3 + s2 * (1.0f / 5 + s2 * (1.0f / 7 + s2 * (1.0f / 9))));
    return static_cast<float>(exponent) * 0.693147181f + 2.0f * s * series;
}

// Exponential race: the light with the smallest key is picked with probability f / sum f, in any order.
inline float race_key(std::uint32_t bits, float f) {
    const float u = (static_cast<float>(bits >> 9) + 0.5f) * 0x1p-23f;  // in (0, 1)
    return -natural_log(u) / f;
}

}  // namespace lab
