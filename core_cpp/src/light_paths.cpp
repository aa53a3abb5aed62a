#include "lab/light_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "lab/luminance.h"
#include "lab/sampling.h"

namespace lab {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr float endless = std::numeric_limits<float>::infinity();

// Solid angle of a spot weighted by its attenuation: full inside, a squared ramp over cosines at the edge.
float spot_solid_angle(const SpotLight& spot) {
    return 2 * pi * ((1 - spot.cos_inner) + (spot.cos_inner - spot.cos_outer) / 3);
}

}  // namespace

LightPaths::LightPaths(const Scene& scene) : scene_(scene) {
    const SceneData& data = scene.data();
    double sum = 0;
    const auto add = [&](Kind kind, std::size_t index, double power) {
        if (!(power > 0)) return;
        sum += power;
        sources_.push_back({kind, index, sum, static_cast<float>(power)});
    };
    const double disc = std::numbers::pi * scene.radius() * static_cast<double>(scene.radius());
    for (std::size_t i = 0; i < data.suns.size(); ++i) add(Kind::sun, i, luminance(data.suns[i].irradiance) * disc);
    for (std::size_t i = 0; i < data.points.size(); ++i)
        add(Kind::point, i, luminance(data.points[i].intensity) * 4 * std::numbers::pi);
    for (std::size_t i = 0; i < data.spots.size(); ++i)
        add(Kind::spot, i, static_cast<double>(luminance(data.spots[i].intensity)) * spot_solid_angle(data.spots[i]));
    double emitted = 0;
    for (const Emitter& e : scene.emitters())
        emitted += static_cast<double>(e.area) * luminance(e.radiance) * pi * (e.two_sided ? 2 : 1);
    add(Kind::emitters, 0, emitted);
    for (Source& s : sources_) {
        s.cumulative /= sum;
        s.probability = static_cast<float>(s.probability / sum);
    }
}

LightPaths::Cone LightPaths::toward_scene(const vec3& position) const {
    const glm::dvec3 to = glm::dvec3(scene_.centre()) - glm::dvec3(position);
    const double distance = glm::length(to), sine = scene_.radius() * 1.001 / distance;
    if (!(sine < 1.0)) return {{0, 0, 1}, 2.0f};  // inside: every direction
    // 1 - cos without the cancellation, for lamps far off.
    return {vec3(to / distance), static_cast<float>(sine * sine / (1.0 + std::sqrt(1.0 - sine * sine)))};
}

EmittedRay LightPaths::emit(std::uint32_t path, std::uint32_t key) const {
    const Random4 a = random4(path, 0, Stream::emit, key), b = random4(path, 1, Stream::emit, key);
    const double u = a.x * 0x1p-32;
    const auto found =
        std::find_if(sources_.begin(), sources_.end(), [u](const Source& s) { return u < s.cumulative; });
    return emit_from(found == sources_.end() ? sources_.back() : *found, a, b);
}

EmittedRay LightPaths::emit_from(const Source& source, const Random4& a, const Random4& b) const {
    const SceneData& data = scene_.data();
    const float u = to_unit(a.y), v = to_unit(a.z), weight = 1.0f / source.probability;
    const float radius = scene_.radius();
    switch (source.kind) {
        case Kind::sun: {  // from a disc of the scene's radius that faces the sun
            const SunLight& sun = data.suns[source.index];
            vec3 s, t;
            frame_around(sun.to_sun, s, t);
            const vec2 d = radius * sample_disc(u, v);
            const vec3 origin = scene_.centre() + d.x * s + d.y * t + 1.01f * radius * sun.to_sun;
            return {{origin, -sun.to_sun, endless}, sun.irradiance * (pi * radius * radius * weight)};
        }
        case Kind::point: {
            const PointLight& point = data.points[source.index];
            const Cone cone = toward_scene(point.position);
            const vec3 direction = sample_cone(cone.axis, cone.spread, u, v);
            return {{point.position, direction, endless}, point.intensity * (cone.solid_angle() * weight)};
        }
        case Kind::spot: {
            const SpotLight& spot = data.spots[source.index];
            const Cone own{spot.direction, 1.0f - spot.cos_outer}, scene = toward_scene(spot.position);
            const Cone cone = own.spread < scene.spread ? own : scene;
            const vec3 direction = sample_cone(cone.axis, cone.spread, u, v);
            const float share = spot_attenuation(spot, glm::dot(direction, spot.direction));
            return {{spot.position, direction, endless}, spot.intensity * (share * cone.solid_angle() * weight)};
        }
        case Kind::emitters:
            break;
    }
    const auto [e, probability] = scene_.choose_emitter(to_unit(a.w));
    const vec2 at = sample_triangle(u, v);
    vec3 normal = scene_.triangle_normal(e.triangle);
    if (e.two_sided && (b.x & 1)) normal = -normal;
    const float power = pi * e.area * (e.two_sided ? 2.0f : 1.0f);
    const vec3 direction = sample_cosine(normal, to_unit(b.y), to_unit(b.z));
    const vec3 origin = scene_.off_surface(scene_.point_on(e.triangle, at.x, at.y), normal);
    return {{origin, direction, endless}, e.radiance * (power * weight / probability)};
}

}  // namespace lab
