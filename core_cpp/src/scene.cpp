#include "lab/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lab/barycentrics.h"
#include "lab/luminance.h"

namespace lab {

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
    fill_rows();
    find_emitters();
    rays_ = std::make_unique<RayTracer>(data_);
}

void Scene::fill_rows() {
    std::vector<std::int32_t> levels{-1};  // of each texture, behind those of none
    for (const Texture& t : data_.textures) {
        const auto follow = static_cast<std::int32_t>(t.mips().size() - 1);
        levels.push_back(follow << TriangleRow::rows | static_cast<std::int32_t>(mips_.size()));
        mips_.insert(mips_.end(), t.mips().begin(), t.mips().end());
    }
    if (!mips_.empty()) mips_.push_back(mips_.back());
    triangles_.resize(data_.triangle.size());
#pragma omp parallel for
    for (std::size_t i = 0; i < data_.triangle.size(); ++i) {
        const glm::uvec3 corner = data_.triangle[i];
        const Material& material = data_.materials[data_.material_of[i]];
        TriangleRow& row = triangles_[i];
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t c = corner[k];
            row.corner[k] = {data_.position[c], data_.uv[c].x, data_.normal[c], data_.uv[c].y};
        }
        const auto& [a, b, c] = row.corner;
        const glm::dvec3 from = a.position;
        const glm::dvec3 n = glm::cross(glm::dvec3(b.position) - from, glm::dvec3(c.position) - from);
        const double length = glm::length(n);
        row.geometric_normal = length > 0 ? vec3(n / length) : vec3(0.0f);
        row.base_colour = material.base_colour;
        row.levels = levels[std::max(material.texture, -1) + 1];
        row.detail = 0.0f;
        if (material.texture >= 0) {
            const Texture& texture = data_.textures[material.texture];
            const double eu = b.u - a.u, ev = b.v - a.v, fu = c.u - a.u, fv = c.v - a.v;
            const double texels = static_cast<double>(texture.width()) * texture.height();
            row.detail = static_cast<float>(0.5 * std::log2(std::abs(eu * fv - ev * fu) * texels / length));
        }
    }
    const auto is_white = [](const vec3& colour) { return colour == vec3(1.0f); };
    coloured_ = !std::all_of(data_.colour.begin(), data_.colour.end(), is_white);
    const auto is_dark = [](const Material& m) { return m.emission == vec3(0.0f); };
    emits_ = !std::all_of(data_.materials.begin(), data_.materials.end(), is_dark);
}

vec3 Scene::vertex_colour(const Hit& hit) const {
    const glm::uvec3 t = data_.triangle[hit.triangle];
    return (1 - hit.u - hit.v) * data_.colour[t.x] + hit.u * data_.colour[t.y] + hit.v * data_.colour[t.z];
}

vec3 Scene::point_on(std::uint32_t triangle, float u, float v) const {
    const glm::uvec3 t = data_.triangle[triangle];
    return (1 - u - v) * data_.position[t.x] + u * data_.position[t.y] + v * data_.position[t.z];
}

vec3 Scene::triangle_normal(std::uint32_t triangle) const {
    return triangles_[triangle].geometric_normal;
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

vec2 texture_point(const TriangleRow& row, const Hit& hit) {
    const auto& [a, b, c] = row.corner;
    const float w = 1 - hit.u - hit.v;
    return w * vec2(a.u, a.v) + hit.u * vec2(b.u, b.v) + hit.v * vec2(c.u, c.v);
}

}  // namespace

void Scene::prefetch_texels(const Hit& hit) const {
    const TriangleRow& row = triangles_[hit.triangle];
    if (row.levels >= 0)
        mips_[row.levels & TriangleRow::row_bits].prefetch(data_.texels.data(), texture_point(row, hit));
}

Hit Scene::settled(const Ray& ray, const Hit& hit) const {
    const auto& [a, b, c] = triangles_[hit.triangle].corner;
    const vec2 anew = barycentrics(ray.origin, ray.direction, a.position, b.position, c.position);
    const vec2 uv = settled_barycentrics({hit.u, hit.v}, anew);
    return {hit.triangle, hit.t, uv.x, uv.y};
}

Surface Scene::surface(const Hit& hit) const {
    const TriangleRow& row = triangles_[hit.triangle];
    const auto& [a, b, c] = row.corner;
    const float w = 1 - hit.u - hit.v;
    Surface s;
    s.position = w * a.position + hit.u * b.position + hit.v * c.position;
    s.geometric_normal = row.geometric_normal;
    const vec3 n = w * a.normal + hit.u * b.normal + hit.v * c.normal;
    const float length = glm::length(n);
    s.normal = length > 1e-6f ? n / length : s.geometric_normal;
    s.albedo = row.base_colour;
    if (coloured_) s.albedo *= vertex_colour(hit);
    if (row.levels >= 0)
        s.albedo *= mips_[row.levels & TriangleRow::row_bits].sample(data_.texels.data(), texture_point(row, hit));
    s.emission = vec3(0.0f);
    s.emits_back = false;
    if (emits_) {
        const Material& material = data_.materials[data_.material_of[hit.triangle]];
        s.emission = material.emission;
        s.emits_back = material.two_sided;
    }
    return s;
}

float spot_attenuation(const SpotLight& spot, float cos_angle) {
    if (cos_angle <= spot.cos_outer) return 0.0f;
    const float t = std::min(1.0f, (cos_angle - spot.cos_outer) / std::max(1e-6f, spot.cos_inner - spot.cos_outer));
    return t * t;
}

}  // namespace lab
