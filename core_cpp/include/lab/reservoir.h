// Picking shadow samples from a stream of lights (LY19 3.3, appendix A).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "lab/random.h"

namespace lab {

// The reservoir's pick is a function of the running sum alone. LY19's appendix A replaces the pick by a light that
// takes the sum of weights from S' to S with probability 1 - S'/S. So the sums at which it is replaced, its records,
// are a Poisson process of rate 1 in ln S, and such a process can be known beforehand: here it is a property of the
// sample, drawn octave by octave, each from its top downward. The pick is the light within whose stretch of the sum
// the last record falls, however the lights come: one by one, in batches of any size, on any engine.

inline float octave_bottom(std::uint32_t octave) {
    const std::uint32_t bits = octave << 23;
    float bottom;
    std::memcpy(&bottom, &bits, sizeof bottom);
    return bottom;
}

// The last record below a sum; 0 where the sum is 0 or hardly more. `next` is the first record that is not below, or
// the sum's octave's end: up to there the answer stays the same.
inline float last_record(float below, std::uint32_t seed, float& next) {
    std::uint32_t bits;
    std::memcpy(&bits, &below, sizeof bits);
    std::uint32_t octave = bits >> 23;  // the exponent: an octave reaches from one power of two to the next
    next = octave_bottom(octave + 1);
    for (; octave > 0; --octave) {
        std::uint32_t state = seed + octave * 0x9e3779b9u;
        // Downward from the octave's top: each record is a uniform share of the one above.
        float share = 2.0f;
        while ((share *= to_unit(pcg(state))) >= 1.0f) {
            const float record = share * octave_bottom(octave);
            if (record < below) return record;
            next = record;
        }
    }
    return 0.0f;
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
