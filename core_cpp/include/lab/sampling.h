// Directions and points drawn from uniform numbers.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

namespace lab {

// Two unit vectors that make a right-handed frame with the unit vector n
// (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
inline void frame_around(const glm::vec3& n, glm::vec3& s, glm::vec3& t) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
}

// sin(pi/2 x) for x in [0, 1], within 2e-7: a polynomial (Chebyshev fit), so that every engine has the same bits.
inline float quarter_sine(float x) {
    const float y = x * x;
    return ((((1.51675122e-4f * y - 4.67415061e-3f) * y + 7.96899199e-2f) * y - 0.645963788f) * y + 1.57079637f) * x;
}

// cos and sin of v turns, v in [0, 1).
inline glm::vec2 turn(float v) {
    const float quarters = 4.0f * v;
    const int quarter = static_cast<int>(quarters);
    const float x = quarters - static_cast<float>(quarter), c = quarter_sine(1.0f - x), s = quarter_sine(x);
    const glm::vec2 swapped = quarter & 1 ? glm::vec2(-s, c) : glm::vec2(c, s);
    return quarter & 2 ? -swapped : swapped;
}

// Uniform on the unit disc.
inline glm::vec2 sample_disc(float u, float v) {
    return std::sqrt(u) * turn(v);
}

// Density cos / pi around the unit vector n.
inline glm::vec3 sample_cosine(const glm::vec3& n, float u, float v) {
    glm::vec3 s, t;
    frame_around(n, s, t);
    const glm::vec2 d = sample_disc(u, v);
    return glm::normalize(d.x * s + d.y * t + std::sqrt(std::max(0.0f, 1.0f - u)) * n);
}

// Uniform over the directions within a cone around the unit vector axis; spread = 1 - cos of its half angle (2:
// sphere).
inline glm::vec3 sample_cone(const glm::vec3& axis, float spread, float u, float v) {
    glm::vec3 s, t;
    frame_around(axis, s, t);
    const float down = u * spread, r = std::sqrt(std::max(0.0f, down * (2.0f - down)));
    const glm::vec2 d = r * turn(v);
    return glm::normalize(d.x * s + d.y * t + (1.0f - down) * axis);
}

// Barycentric coordinates (u, v), uniform over a triangle.
inline glm::vec2 sample_triangle(float u, float v) {
    const float root = std::sqrt(u);
    return {root * (1.0f - v), root * v};
}

}  // namespace lab
