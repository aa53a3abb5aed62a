#include "lab/direct_light.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "lab/sampling.h"

namespace lab {
namespace {

// Irradiance from a point light of the given intensity, by distance and the receiver's cosine.
DirectCandidate from_intensity(const Scene& scene, const vec3& position, const vec3& intensity, const LitPoint& at) {
    const vec3 to = position - at.position;
    const float d2 = std::max(glm::dot(to, to), std::numeric_limits<float>::min());
    const float cosine = std::max(0.0f, glm::dot(at.normal, to) / std::sqrt(d2));
    return {shadow_ray(scene, at, position), intensity * (cosine / d2)};
}

}  // namespace

DirectCandidate from_point(const Scene& scene, const PointLight& point, const LitPoint& at) {
    return from_intensity(scene, point.position, point.intensity, at);
}

DirectCandidate from_spot(const Scene& scene, const SpotLight& spot, const LitPoint& at) {
    const vec3 to = at.position - spot.position;
    const float length = std::max(glm::length(to), std::numeric_limits<float>::min());
    const float share = spot_attenuation(spot, glm::dot(to, spot.direction) / length);
    return from_intensity(scene, spot.position, spot.intensity * share, at);
}

DirectCandidate from_emitters(const Scene& scene, const LitPoint& at, const Random4& random) {
    const auto [e, probability] = scene.choose_emitter(to_unit(random.x));
    const vec2 b = sample_triangle(to_unit(random.y), to_unit(random.z));
    const vec3 point = scene.point_on(e.triangle, b.x, b.y), normal = scene.triangle_normal(e.triangle);
    const vec3 to = point - at.position;
    const float d2 = std::max(glm::dot(to, to), std::numeric_limits<float>::min()), d = std::sqrt(d2);
    const float facing = -glm::dot(normal, to) / d;
    const float emitted = e.two_sided ? std::abs(facing) : std::max(0.0f, facing);
    const float cosine = std::max(0.0f, glm::dot(at.normal, to) / d);
    const vec3 target = scene.off_surface(point, facing < 0 ? -normal : normal);
    return {shadow_ray(scene, at, target), e.radiance * (cosine * emitted / d2 * e.area / probability)};
}

}  // namespace lab
