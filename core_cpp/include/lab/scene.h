// The scene as the core holds it: one soup of triangles, materials, textures and lights, and a ray tracer
// over them.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "lab/ray_tracer.h"
#include "lab/select.h"
#include "lab/texture.h"

namespace lab {

using glm::vec2;
using glm::vec3;

struct Material {
    vec3 base_colour;
    int texture;  // -1: none
    float alpha, alpha_cutoff;
    vec3 emission;
    bool two_sided;
};

struct SunLight {
    vec3 to_sun, irradiance;
};

struct PointLight {
    vec3 position, intensity;
};

struct SpotLight {
    vec3 position, direction, intensity;
    float cos_inner, cos_outer;
};

// An emissive triangle, with the share of the power of all of them up to and with it.
struct Emitter {
    std::uint32_t triangle;
    float area, cumulative;
    vec3 radiance;
    bool two_sided;
};

// Arrays of the scene. Vertex arrays are as long as `position`; a zero normal means "use the triangle's own".
struct SceneData {
    std::vector<vec3> position, normal, colour;
    std::vector<vec2> uv;
    std::vector<glm::uvec3> triangle;
    std::vector<std::uint32_t> material_of;  // of each triangle
    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::vector<SunLight> suns;
    std::vector<PointLight> points;
    std::vector<SpotLight> spots;
};

// A vertex and a material in one row each, for those who look at many in any order.
struct VertexRow {
    vec3 position;
    float u;
    vec3 normal;
    float v;
    vec3 colour;
    float unused;
};
struct MaterialRow {
    vec3 base_colour;
    std::int32_t texture;
    vec3 emission;
    float emits_back;  // 1 or 0
};
// And a texture: its levels are rows `first_mip` .. `first_mip` + `last` of Scene::mips().
struct TextureRow {
    std::int32_t first_mip;
    float last, half_log2_texels, unused;
};

// What a ray found. Normals are as modelled until they are turned.
struct Surface {
    vec3 position, normal, geometric_normal, albedo, emission;
    bool emits_back;

    // Turns both normals to the side that a ray along `arriving` comes from, and tells whether that is the front. The
    // interpolated normal follows the geometric one: at a silhouette it may itself lean away from the ray, and turned
    // by its own sign it would look into the surface.
    bool turn_toward(const vec3& arriving);
};

class Scene {
  public:
    explicit Scene(SceneData data);

    const SceneData& data() const { return data_; }
    const RayTracer& rays() const { return *rays_; }
    const std::vector<VertexRow>& vertices() const { return vertices_; }
    const std::vector<MaterialRow>& materials() const { return materials_; }
    const std::vector<TextureRow>& textures() const { return textures_; }
    const std::vector<Mip>& mips() const { return mips_; }
    const std::vector<Emitter>& emitters() const { return emitters_; }
    vec3 centre() const { return centre_; }
    float radius() const { return radius_; }

    // The surface at `hit`. `footprint`: width of the ray's cone there, 0 for the textures' full resolution.
    Surface surface(const Hit& hit, float footprint) const;
    // The hit with barycentrics that depend on the ray and the triangle alone, not on the ray tracer.
    Hit settled(const Ray& ray, const Hit& hit) const;
    // Brings near what surface(hit, 0) will read: of many hits in any order, each would wait for memory on its own.
    void prefetch(const Hit& hit) const;
    // `point` moved off its surface by what float can resolve here, to the side that `normal` shows to.
    vec3 off_surface(const vec3& point, const vec3& normal) const {
        const vec3 size = glm::abs(point);
        const float largest = larger(size.x, larger(size.y, size.z));
        return point + (1e-5f * radius_ + 4e-7f * largest) * normal;
    }
    // A triangle's corner-weighted point and its unit normal.
    vec3 point_on(std::uint32_t triangle, float u, float v) const;
    vec3 triangle_normal(std::uint32_t triangle) const;

    // The emissive triangle that a uniform number chooses, in proportion to power, and the chance that it had.
    struct ChosenEmitter {
        const Emitter& emitter;
        float probability;
    };
    ChosenEmitter choose_emitter(float uniform) const;

  private:
    SceneData data_;
    std::unique_ptr<RayTracer> rays_;
    std::vector<VertexRow> vertices_;
    std::vector<MaterialRow> materials_;
    std::vector<TextureRow> textures_;
    std::vector<Mip> mips_;
    std::vector<Emitter> emitters_;
    vec3 centre_{0.0f};
    float radius_ = 1.0f;

    void find_emitters();
};

// Share of a spot's intensity toward a direction at cos_angle from its axis (KHR_lights_punctual's smooth
// edge).
float spot_attenuation(const SpotLight& spot, float cos_angle);

}  // namespace lab
