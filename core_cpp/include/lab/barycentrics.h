// Where a ray meets the plane of a triangle, in the triangle's own coordinates.
#pragma once

#include <glm/glm.hpp>

namespace lab {

// (u, v) of the point (1-u-v) a + u b + v c (Moeller & Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection",
// JGT 2(1), 1997); not finite where the ray runs along the plane.
inline glm::vec2 barycentrics(const glm::vec3& origin, const glm::vec3& direction, const glm::vec3& a,
                              const glm::vec3& b, const glm::vec3& c) {
    const glm::vec3 ab = b - a, ac = c - a, from = origin - a;
    const glm::vec3 p = glm::cross(direction, ac), q = glm::cross(from, ab);
    const float volume = glm::dot(ab, p);
    return {glm::dot(from, p) / volume, glm::dot(direction, q) / volume};
}

// Ray tracers round each in their own way, and after a few bounces of a path that is seen. So whoever follows paths
// computes anew where they meet the triangle that was found, unless the answer lies off it: (u, v) of a ray's hit.
inline glm::vec2 settled_barycentrics(const glm::vec2& found, const glm::vec2& anew) {
    const float slack = 1e-3f;
    const bool on_it = anew.x >= -slack && anew.y >= -slack && anew.x + anew.y <= 1.0f + slack;
    return on_it ? anew : found;
}

}  // namespace lab
