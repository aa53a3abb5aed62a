// The scene: arrays from lab/engine/cpu.py, flattened to one soup of triangles.
#include "lab/scene.h"

#include <cmath>

#include "arrays.h"
#include "bind.h"
#include "lab/direct_light.h"

namespace lab::bind {
namespace {

template <class T>
std::vector<T> copy(const py::handle& object, const char* name, std::size_t count) {
    const auto span = view<T>(object, name, count);
    return {span.begin(), span.end()};
}

SceneData scene_data(const py::object& position, const py::object& normal, const py::object& uv,
                     const py::object& colour, const py::object& triangle, const py::object& material_of,
                     const py::object& scene) {
    SceneData data;
    const std::size_t vertices = view<vec3>(position, "position").size();
    const std::size_t triangles = view<glm::uvec3>(triangle, "triangle").size();
    data.position = copy<vec3>(position, "position", vertices);
    data.normal = copy<vec3>(normal, "normal", vertices);
    data.uv = copy<vec2>(uv, "uv", vertices);
    data.colour = copy<vec3>(colour, "colour", vertices);
    data.triangle = copy<glm::uvec3>(triangle, "triangle", triangles);
    data.material_of = copy<std::uint32_t>(material_of, "material_of", triangles);
    for (const py::handle m : scene.attr("materials"))
        data.materials.push_back({vec3_from(m.attr("base_colour")), m.attr("texture").cast<int>(),
                                  m.attr("alpha").cast<float>(), m.attr("alpha_cutoff").cast<float>(),
                                  vec3_from(m.attr("emission")), m.attr("two_sided").cast<bool>()});
    for (const py::handle t : scene.attr("textures")) {
        const auto shape = t.attr("shape").cast<std::array<int, 3>>();
        if (shape[0] < 1 || shape[1] < 1 || shape[2] != 4)
            throw py::type_error("texture: expected (h, w, 4), at least one pixel");
        data.textures.emplace_back(shape[1], shape[0], view<std::uint8_t>(t, "texture"), data.texels);
    }
    for (const glm::uvec3& t : data.triangle)
        if (t.x >= vertices || t.y >= vertices || t.z >= vertices)
            throw py::value_error("triangle: an index is out of range");
    for (const std::uint32_t m : data.material_of)
        if (m >= data.materials.size()) throw py::value_error("material_of: an index is out of range");
    for (const Material& m : data.materials)
        if (m.texture >= static_cast<int>(data.textures.size())) throw py::value_error("material: no such texture");
    for (const py::handle s : scene.attr("suns"))
        data.suns.push_back({glm::normalize(vec3_from(s.attr("to_sun"))), vec3_from(s.attr("irradiance"))});
    for (const py::handle p : scene.attr("points"))
        data.points.push_back({vec3_from(p.attr("position")), vec3_from(p.attr("intensity"))});
    for (const py::handle s : scene.attr("spots"))
        data.spots.push_back({vec3_from(s.attr("position")), glm::normalize(vec3_from(s.attr("direction"))),
                              vec3_from(s.attr("intensity")), std::cos(s.attr("inner_angle").cast<float>()),
                              std::cos(s.attr("outer_angle").cast<float>())});
    return data;
}

// Nearest hits of arbitrary rays, for tools and tests: (t, triangle), t = inf and triangle = -1 for a miss.
py::tuple intersect(const Scene& scene, const py::object& origin, const py::object& direction) {
    const auto o = view<vec3>(origin, "origin"), d = view<vec3>(direction, "direction", o.size());
    std::vector<Ray> rays(o.size());
    for (std::size_t i = 0; i < o.size(); ++i) rays[i] = {o[i], d[i], std::numeric_limits<float>::infinity()};
    std::vector<Hit> hits(rays.size());
    {
        const py::gil_scoped_release release;
        scene.rays().intersect(rays, hits, Coherence::incoherent);
    }
    std::vector<float> t;
    std::vector<std::int32_t> triangle;
    for (const Hit& hit : hits) {
        t.push_back(hit.found() ? hit.t : std::numeric_limits<float>::infinity());
        triangle.push_back(hit.found() ? static_cast<std::int32_t>(hit.triangle) : -1);
    }
    return py::make_tuple(to_numpy(std::move(t)), to_numpy(std::move(triangle)));
}

// 1 where the segment from origin to target is free.
py::array visible(const Scene& scene, const py::object& origin, const py::object& target) {
    const auto o = view<vec3>(origin, "origin"), q = view<vec3>(target, "target", o.size());
    std::vector<Ray> rays(o.size());
    for (std::size_t i = 0; i < o.size(); ++i) rays[i] = {o[i], q[i] - o[i], 1.0f};
    std::vector<std::uint8_t> free(rays.size());
    {
        const py::gil_scoped_release release;
        scene.rays().visible(rays, free, Coherence::incoherent);
    }
    return to_numpy(std::move(free));
}

// As shadow samples look: from just off a surface point, on the side of its normal, to each target.
py::array visible_from(const Scene& scene, const py::object& point, const py::object& side, const py::object& targets) {
    const vec3 p = view<vec3>(point, "point", 1)[0], n = view<vec3>(side, "side", 1)[0];
    const auto q = view<vec3>(targets, "targets");
    std::vector<Ray> rays;
    for (const vec3& target : q) rays.push_back(shadow_ray(scene, {p, n, n}, target));
    std::vector<std::uint8_t> free(rays.size());
    {
        const py::gil_scoped_release release;
        scene.rays().visible(rays, free, Coherence::incoherent);
    }
    return to_numpy(std::move(free));
}

}  // namespace

void bind_scene(py::module_& m) {
    py::class_<Scene>(m, "Scene", "A scene ready for rays.")
        .def(py::init([](const py::object& position, const py::object& normal, const py::object& uv,
                         const py::object& colour, const py::object& triangle, const py::object& material_of,
                         const py::object& scene) {
                 SceneData data = scene_data(position, normal, uv, colour, triangle, material_of, scene);
                 const py::gil_scoped_release release;
                 return std::make_unique<Scene>(std::move(data));
             }),
             py::arg("position"), py::arg("normal"), py::arg("uv"), py::arg("colour"), py::arg("triangle"),
             py::arg("material_of"), py::arg("scene"))
        .def_property_readonly("radius", &Scene::radius, "Of the sphere around the geometry, R.")
        .def("intersect", &intersect, py::arg("origin"), py::arg("direction"))
        .def("visible", &visible, py::arg("origin"), py::arg("target"))
        .def("visible_from", &visible_from, py::arg("point"), py::arg("side"), py::arg("targets"));
}

}  // namespace lab::bind
