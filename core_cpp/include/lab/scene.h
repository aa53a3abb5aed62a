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
    Buffer<Texel> texels;  // of all textures
    std::vector<SunLight> suns;
    std::vector<PointLight> points;
    std::vector<SpotLight> spots;
};

// All that most hits need of their triangle, in two lines of memory.
struct alignas(64) TriangleRow {
    struct Corner {
        vec3 position;
        float u;
        vec3 normal;
        float v;
    };
    Corner corner[3];
    vec3 geometric_normal;
    float detail;  // log2 of the edge of its picture in the full texture, in texels, over its own edge
    vec3 base_colour;
    std::int32_t levels;  // of its texture: row of Scene::mips(), and from bit `rows` on how many follow; -1: none

    static constexpr int rows = 26;
    static constexpr std::int32_t row_bits = (1 << rows) - 1;
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
    const Buffer<TriangleRow>& triangles() const { return triangles_; }
    // Of all textures; behind the last one's is another, for those who always look at two.
    const std::vector<Mip>& mips() const { return mips_; }
    bool coloured() const { return coloured_; }  // some vertex has a colour other than white
    bool emits() const { return emits_; }        // some material has an emission
    // The vertices' colours at `hit`.
    vec3 vertex_colour(const Hit& hit) const;
    const std::vector<Emitter>& emitters() const { return emitters_; }
    vec3 centre() const { return centre_; }
    float radius() const { return radius_; }

    // The surface at `hit`, by the textures' full resolution.
    Surface surface(const Hit& hit) const;
    // The hit with barycentrics that depend on the ray and the triangle alone, not on the ray tracer.
    Hit settled(const Ray& ray, const Hit& hit) const;
    // Bring near what surface(hit) will read, the texels once the triangle is here: of many hits in any order, each
    // would wait for memory on its own.
    LAB_INLINE void prefetch_triangle(std::uint32_t triangle) const {
        const auto* row = reinterpret_cast<const char*>(&triangles_[triangle]);
        hwy::Prefetch(row);
        hwy::Prefetch(row + 64);
    }
    void prefetch_texels(const Hit& hit) const;
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
    Buffer<TriangleRow> triangles_;
    std::vector<Mip> mips_;
    std::vector<Emitter> emitters_;
    vec3 centre_{0.0f};
    float radius_ = 1.0f;
    bool coloured_ = false, emits_ = false;

    void fill_rows();
    void find_emitters();
};

// Share of a spot's intensity toward a direction at cos_angle from its axis (KHR_lights_punctual's smooth
// edge).
float spot_attenuation(const SpotLight& spot, float cos_angle);

}  // namespace lab
