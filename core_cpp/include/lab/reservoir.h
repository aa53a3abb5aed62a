// Picking shadow samples from a stream of lights (LY19 3.3, appendix A).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "lab/select.h"

namespace lab {

// How a light of weight f changes a reservoir whose running sum was `before` and is `after` = before + f.
struct ReservoirStep {
    float take;         // probability f / after of replacing the pick
    float taken_scale;  // u < take: u * taken_scale is uniform again
    float kept_scale;   // else: (u - take) * kept_scale is
};

inline ReservoirStep reservoir_step(float before, float f) {
    const float after = before + f;
    const bool counts = f > 0.0f;
    return {counts ? f / after : 0.0f, counts ? after / f : 0.0f, before > 0.0f ? after / before : 1.0f};
}

// One decision. The uniform is re-scaled, not redrawn: given the outcome it is uniform again.
inline void reservoir_decide(const ReservoirStep& step, std::int32_t light, float& uniform, std::int32_t& pick) {
    const bool take = uniform < step.take;
    const float next = take ? uniform * step.taken_scale : (uniform - step.take) * step.kept_scale;
    uniform = larger(0.0f, smaller(next, 0x1.fffffep-1f));
    pick = take ? light : pick;
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
