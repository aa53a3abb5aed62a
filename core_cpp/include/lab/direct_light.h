// Direct light of the scene's own lights at a point: sun, point and spot by one ray each, emissive triangles
// by area samples. Visibility is the caller's: a candidate says what arrives if its ray is free.
#pragma once

#include "lab/random.h"
#include "lab/scene.h"

namespace lab {

struct DirectCandidate {
    Ray ray;
    vec3 irradiance;  // zero: nothing arrives, the ray need not be traced
};

struct LitPoint {
    vec3 position, normal, geometric_normal;  // normals toward the viewer
};

DirectCandidate from_sun(const Scene& scene, const SunLight& sun, const LitPoint& at);
DirectCandidate from_point(const Scene& scene, const PointLight& point, const LitPoint& at);
DirectCandidate from_spot(const Scene& scene, const SpotLight& spot, const LitPoint& at);
// One area sample; `random` chooses the triangle in proportion to its power and the point on it.
DirectCandidate from_emitters(const Scene& scene, const LitPoint& at, const Random4& random);

// From just off the receiver's surface to `target`, stopping short of it.
Ray shadow_ray(const Scene& scene, const LitPoint& at, const vec3& target);

}  // namespace lab
