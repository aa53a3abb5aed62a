#include "lab/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lab/barycentrics.h"
#include "lab/luminance.h"

namespace lab {
namespace {

vec3 unit_normal(const VertexRow& a, const VertexRow& b, const VertexRow& c) {
    const glm::dvec3 from = a.position;
    const glm::dvec3 n = glm::cross(glm::dvec3(b.position) - from, glm::dvec3(c.position) - from);
    const double length = glm::length(n);
    return length > 0 ? vec3(n / length) : vec3(0.0f);
}

}  // namespace

Scene::Scene(SceneData data) : data_(std::move(data)) {
    vec3 low(std::numeric_limits<float>::max()), high = -low;
    for (const glm::uvec3& t : data_.triangle)
        for (int k = 0; k < 3; ++k) {
            low = glm::min(low, data_.position[t[k]]);
            high = glm::max(high, data_.position[t[k]]);
        }
    centre_ = 0.5f * (low + high);
    radius_ = 0.0f;
    for (const glm::uvec3& t : data_.triangle)
        for (int k = 0; k < 3; ++k) radius_ = std::max(radius_, glm::distance(centre_, data_.position[t[k]]));
    vertices_.reserve(data_.position.size());
    for (std::size_t i = 0; i < data_.position.size(); ++i)
        vertices_.push_back({data_.position[i], data_.uv[i].x, data_.normal[i], data_.uv[i].y, data_.colour[i], 0.0f});
    for (const Material& m : data_.materials)
        materials_.push_back({m.base_colour, m.texture, m.emission, m.two_sided ? 1.0f : 0.0f});
    for (const Texture& t : data_.textures) {
        const std::vector<Mip>& mips = t.mips();
        const auto last = static_cast<float>(mips.size() - 1);
        textures_.push_back({static_cast<std::int32_t>(mips_.size()), last, 0.5f * t.log2_texels(), 0.0f});
        mips_.insert(mips_.end(), mips.begin(), mips.end());
    }
    find_emitters();
    rays_ = std::make_unique<RayTracer>(data_);
}

vec3 Scene::point_on(std::uint32_t triangle, float u, float v) const {
    const glm::uvec3 t = data_.triangle[triangle];
    return (1 - u - v) * data_.position[t.x] + u * data_.position[t.y] + v * data_.position[t.z];
}

vec3 Scene::triangle_normal(std::uint32_t triangle) const {
    const glm::uvec3 t = data_.triangle[triangle];
    return unit_normal(vertices_[t.x], vertices_[t.y], vertices_[t.z]);
}

void Scene::find_emitters() {
    double sum = 0;
    std::vector<double> cumulative;
    for (std::uint32_t t = 0; t < data_.triangle.size(); ++t) {
        const Material& material = data_.materials[data_.material_of[t]];
        const glm::uvec3 c = data_.triangle[t];
        const glm::dvec3 a = data_.position[c.x];
        const double area =
            0.5 * glm::length(glm::cross(glm::dvec3(data_.position[c.y]) - a, glm::dvec3(data_.position[c.z]) - a));
        const double power = area * luminance(material.emission) * (material.two_sided ? 2 : 1);
        if (!(power > 0)) continue;
        sum += power;
        cumulative.push_back(sum);
        emitters_.push_back({t, static_cast<float>(area), 0, material.emission, material.two_sided});
    }
    for (std::size_t i = 0; i < emitters_.size(); ++i)
        emitters_[i].cumulative = static_cast<float>(cumulative[i] / sum);
    if (!emitters_.empty()) emitters_.back().cumulative = 1.0f;
}

Scene::ChosenEmitter Scene::choose_emitter(float uniform) const {
    const auto e = std::min(std::upper_bound(emitters_.begin(), emitters_.end(), uniform,
                                             [](float u, const Emitter& x) { return u < x.cumulative; }),
                            emitters_.end() - 1);
    const float below = e == emitters_.begin() ? 0.0f : (e - 1)->cumulative;
    return {*e, std::max(e->cumulative - below, std::numeric_limits<float>::min())};
}

bool Surface::turn_toward(const vec3& arriving) {
    const bool front = glm::dot(geometric_normal, arriving) <= 0;
    if (!front) geometric_normal = -geometric_normal;
    if (glm::dot(normal, geometric_normal) < 0) normal = -normal;
    return front;
}

namespace {

vec2 texture_point(const VertexRow& a, const VertexRow& b, const VertexRow& c, const Hit& hit) {
    const float w = 1 - hit.u - hit.v;
    return w * vec2(a.u, a.v) + hit.u * vec2(b.u, b.v) + hit.v * vec2(c.u, c.v);
}

}  // namespace

void Scene::prefetch(const Hit& hit) const {
    const int texture = materials_[data_.material_of[hit.triangle]].texture;
    if (texture < 0) return;
    const glm::uvec3 t = data_.triangle[hit.triangle];
    data_.textures[texture].prefetch(texture_point(vertices_[t.x], vertices_[t.y], vertices_[t.z], hit));
}

Hit Scene::settled(const Ray& ray, const Hit& hit) const {
    const glm::uvec3 t = data_.triangle[hit.triangle];
    const vec2 uv =
        settled_barycentrics({hit.u, hit.v}, barycentrics(ray.origin, ray.direction, vertices_[t.x].position,
                                                          vertices_[t.y].position, vertices_[t.z].position));
    return {hit.triangle, hit.t, uv.x, uv.y};
}

Surface Scene::surface(const Hit& hit, float footprint) const {
    const glm::uvec3 t = data_.triangle[hit.triangle];
    const VertexRow &a = vertices_[t.x], &b = vertices_[t.y], &c = vertices_[t.z];
    const float w = 1 - hit.u - hit.v;
    const MaterialRow& material = materials_[data_.material_of[hit.triangle]];
    Surface s;
    s.position = w * a.position + hit.u * b.position + hit.v * c.position;
    s.geometric_normal = unit_normal(a, b, c);
    const vec3 n = w * a.normal + hit.u * b.normal + hit.v * c.normal;
    const float length = glm::length(n);
    s.normal = length > 1e-6f ? n / length : s.geometric_normal;
    s.albedo = material.base_colour * (w * a.colour + hit.u * b.colour + hit.v * c.colour);
    s.emission = material.emission;
    s.emits_back = material.emits_back > 0;
    if (material.texture >= 0) {
        const Texture& texture = data_.textures[material.texture];
        float level = 0;
        if (footprint > 0) {  // texels per pixel: ratio of the triangle's areas in texels and in space
            const float eu = b.u - a.u, ev = b.v - a.v, fu = c.u - a.u, fv = c.v - a.v;
            const float texels = std::abs(eu * fv - ev * fu) * static_cast<float>(texture.width()) *
                                 static_cast<float>(texture.height());
            const float area = glm::length(glm::cross(b.position - a.position, c.position - a.position));
            level = 0.5f * std::log2(texels / area * footprint * footprint);
        }
        s.albedo *= texture.sample(texture_point(a, b, c, hit), level);
    }
    return s;
}

float spot_attenuation(const SpotLight& spot, float cos_angle) {
    if (cos_angle <= spot.cos_outer) return 0.0f;
    const float t = std::min(1.0f, (cos_angle - spot.cos_outer) / std::max(1e-6f, spot.cos_inner - spot.cos_outer));
    return t * t;
}

}  // namespace lab
