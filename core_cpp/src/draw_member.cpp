#include "lab/draw_member.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lab {

namespace {

// The first of `count` rising numbers that is above `bits`; the last one where none is. Most lists rise evenly: the
// search starts where an even one would have it, and so touches little memory.
std::int64_t entry_above(const std::uint32_t* cumulative, std::int64_t count, std::uint32_t bits) {
    const auto guess = static_cast<std::int64_t>((std::uint64_t{bits} * static_cast<std::uint64_t>(count)) >> 32);
    std::int64_t low = 0, high = count - 1;  // between them lies the answer
    std::int64_t probe = guess, step = 1;
    if (cumulative[guess] > bits) {
        for (; probe >= 0 && cumulative[probe] > bits; probe = guess - step, step *= 2) high = probe;
        low = std::max<std::int64_t>(0, probe + 1);
    } else {
        for (; probe < high && cumulative[probe] <= bits; probe = guess + step, step *= 2) low = probe + 1;
        high = std::min(high, probe);
    }
    return std::upper_bound(cumulative + low, cumulative + high, bits) - cumulative;
}

}  // namespace

std::uint32_t draw_member(const HierarchyView& h, std::uint32_t light, const Random4& random) {
    const auto inputs = static_cast<std::uint32_t>(h.input_index.size());
    std::uint32_t bits = random.x;
    while (light >= inputs) {  // once, or through S1
        const std::size_t row = light - inputs;
        const std::int64_t first = h.members.offset[row], count = h.members.offset[row + 1] - first;
        light = h.members.light[first + entry_above(h.members.cumulative.data() + first, count, bits)];
        bits = random.y;
    }
    return light;
}

float sample_raised_cosine(float u) {
    // The distribution x/2 + sin(pi x)/(2 pi) + 1/2 has no closed inverse: a table, inverted once by
    // bisection.
    constexpr int steps = 4096;
    static const std::array<float, steps + 1> table = [] {
        std::array<float, steps + 1> inverse{};
        for (int i = 0; i <= steps; ++i) {
            double low = -1, high = 1;
            for (int k = 0; k < 60; ++k) {
                const double x = 0.5 * (low + high);
                const double share = 0.5 * (x + std::sin(std::numbers::pi * x) / std::numbers::pi + 1);
                (share * steps < i ? low : high) = x;
            }
            inverse[i] = static_cast<float>(0.5 * (low + high));
        }
        return inverse;
    }();
    const float at = u * steps;
    const int i = std::min(static_cast<int>(at), steps - 1);
    return table[i] + (at - static_cast<float>(i)) * (table[i + 1] - table[i]);
}

vec3 jittered_point(const HierarchyView& h, std::uint32_t light, float deviation_scale, const Random4& random) {
    const vec3 xi(sample_raised_cosine(to_unit(random.x)), sample_raised_cosine(to_unit(random.y)),
                  sample_raised_cosine(to_unit(random.z)));
    return h.position[light] + deviation_scale * std::numbers::pi_v<float> * xi * h.deviation[light];
}

}  // namespace lab
