#include "lab/jitter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lab {

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
