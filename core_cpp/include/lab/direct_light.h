// Direct light of the scene's own lights at a point: sun, point and spot by one ray each, emissive triangles
// by area samples. Visibility is the caller's: a candidate says what arrives if its ray is free.
#pragma once

#include <limits>

#include "lab/random.h"
#include "lab/scene.h"
#include "lab/select.h"

namespace lab {

struct DirectCandidate {
    Ray ray;
    vec3 irradiance;  // zero: nothing arrives, the ray need not be traced
};

struct LitPoint {
    vec3 position, normal, geometric_normal;  // normals toward the viewer
};

// `origin`: just off the surface.
inline DirectCandidate from_sun(const SunLight& sun, const vec3& normal, const vec3& origin) {
    const float cosine = larger(0.0f, glm::dot(normal, sun.to_sun));
    return {{origin, sun.to_sun, std::numeric_limits<float>::infinity()}, sun.irradiance * cosine};
}
inline DirectCandidate from_sun(const Scene& scene, const SunLight& sun, const LitPoint& at) {
    return from_sun(sun, at.normal, scene.off_surface(at.position, at.geometric_normal));
}
DirectCandidate from_point(const Scene& scene, const PointLight& point, const LitPoint& at);
DirectCandidate from_spot(const Scene& scene, const SpotLight& spot, const LitPoint& at);
// One area sample; `random` chooses the triangle in proportion to its power and the point on it.
DirectCandidate from_emitters(const Scene& scene, const LitPoint& at, const Random4& random);

// From just off the receiver's surface to `target`, stopping short of it.
inline constexpr float shadow_ray_length = 1.0f - 1e-4f;  // of the way
inline Ray shadow_ray(const Scene& scene, const LitPoint& at, const vec3& target) {
    const vec3 origin = scene.off_surface(at.position, at.geometric_normal);
    return {origin, target - origin, shadow_ray_length};
}

}  // namespace lab
