// Directions and points drawn from uniform numbers.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

namespace lab {

// Two unit vectors that make a right-handed frame with the unit vector n
// (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
inline void frame_around(const glm::vec3& n, glm::vec3& s, glm::vec3& t) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
}

// Uniform on the unit disc.
inline glm::vec2 sample_disc(float u, float v) {
    const float r = std::sqrt(u), phi = 2.0f * std::numbers::pi_v<float> * v;
    return {r * std::cos(phi), r * std::sin(phi)};
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
    const float phi = 2.0f * std::numbers::pi_v<float> * v;
    return glm::normalize(r * std::cos(phi) * s + r * std::sin(phi) * t + (1.0f - down) * axis);
}

// Barycentric coordinates (u, v), uniform over a triangle.
inline glm::vec2 sample_triangle(float u, float v) {
    const float root = std::sqrt(u);
    return {root * (1.0f - v), root * v};
}

}  // namespace lab
