// The stages: records in, dicts of arrays out (lab/engine/cpu.py makes the records).
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "arrays.h"
#include "bind.h"
#include "lab/build_hierarchy.h"
#include "lab/build_members.h"
#include "lab/composite.h"
#include "lab/light.h"
#include "lab/render_gbuffer.h"
#include "lab/s1_sums.h"
#include "lab/scene.h"
#include "lab/trace_shadow_rays.h"
#include "lab/trace_vpls.h"
#include "records.h"

namespace lab::bind {
namespace {

py::dict trace_vpls_(const Scene& scene, const py::dict& params) {
    const Params p = params_from(params);
    VplData vpls = without_gil([&] { return trace_vpls(scene, p); });
    py::dict d;
    d["position"] = to_numpy(std::move(vpls.position));
    d["flux"] = to_numpy(std::move(vpls.flux));
    d["normal"] = to_numpy(std::move(vpls.normal));
    d["paths_launched"] = vpls.paths_launched;
    return d;
}

py::dict build_hierarchy_(const py::object& lights, const py::dict& params) {
    const Params p = params_from(params);
    const LightsView in = lights_view(lights);
    HierarchyData h = without_gil([&] { return build_hierarchy(in, p); });
    py::dict d;
    d["origin"] = to_numpy(std::vector<float>{h.origin.x, h.origin.y, h.origin.z});
    d["cell_size"] = to_numpy(std::move(h.cell_size));
    d["offset"] = to_numpy(std::move(h.offset));
    d["position"] = to_numpy(std::move(h.lights.position));
    d["flux"] = to_numpy(std::move(h.lights.flux));
    d["normal"] = to_numpy(std::move(h.lights.normal));
    d["normal_moment"] = to_numpy(std::move(h.lights.normal_moment));
    d["deviation"] = to_numpy(std::move(h.lights.deviation));
    d["vertex"] = to_numpy(std::move(h.lights.vertex));
    d["oriented"] = to_numpy(std::move(h.lights.oriented));
    d["input_index"] = to_numpy(std::move(h.input_index));
    return d;
}

// All numbers of S1's fixed-point sums, 24 a light.
py::array s1_sums_(const py::object& lights, const py::dict& params) {
    const Params p = params_from(params);
    const LightsView in = lights_view(lights);
    return to_numpy(without_gil([&] { return s1_sums(in, p); }));
}

py::dict build_members_(const py::object& hierarchy, const py::dict& params) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    MemberData members = without_gil([&] { return build_members(h, p); });
    py::dict d;
    d["offset"] = to_numpy(std::move(members.offset));
    d["slot"] = to_numpy(std::move(members.slot));
    return d;
}

py::dict render_gbuffer_(const Scene& scene, const py::object& camera, int width, int height) {
    const Camera c = camera_from(camera);
    GBufferData g = without_gil([&] { return render_gbuffer(scene, c, width, height); });
    py::dict d;
    d["position"] = to_numpy(std::move(g.position), {height, width});
    d["normal"] = to_numpy(std::move(g.normal), {height, width});
    d["geometric_normal"] = to_numpy(std::move(g.geometric_normal), {height, width});
    d["albedo"] = to_numpy(std::move(g.albedo), {height, width});
    d["emission"] = to_numpy(std::move(g.emission), {height, width});
    d["depth"] = to_numpy(std::move(g.depth), {height, width});
    d["pixel_angle"] = g.pixel_angle;
    return d;
}

py::dict light_(const py::object& hierarchy, const py::object& gbuffer, const py::dict& params, float scene_radius,
                bool counts) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    const GBufferView g = gbuffer_view(gbuffer);
    LightingData l = without_gil([&] { return light(h, g, p, scene_radius, counts); });
    const py::ssize_t levels = h.top() + 1, k = p.shadow_samples;
    py::dict d;
    d["irradiance"] = to_numpy(std::move(l.irradiance), {g.height, g.width});
    d["overdraw"] = py::none();
    d["lights_used"] = py::none();
    if (counts) {
        d["overdraw"] = to_numpy(std::move(l.overdraw), {levels, g.height, g.width});
        d["lights_used"] = to_numpy(std::move(l.lights_used), {levels, g.height, g.width});
    }
    d["light"] = to_numpy(std::move(l.light), {g.height, g.width, k});
    d["target_weight"] = to_numpy(std::move(l.target_weight), {g.height, g.width, k});
    d["weight_sum"] = to_numpy(std::move(l.weight_sum), {g.height, g.width});
    d["visited"] = l.visited;
    return d;
}

py::dict trace_shadow_rays_(const Scene& scene, const py::object& hierarchy, const py::object& gbuffer,
                            const py::object& lighting, const py::dict& params) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    const GBufferView g = gbuffer_view(gbuffer);
    const LightingView l = lighting_view(lighting, g, p.shadow_samples);
    const auto lights = static_cast<std::int32_t>(h.position.size());
    if (std::any_of(l.light.begin(), l.light.end(), [&](std::int32_t pick) { return pick >= lights; }))
        throw py::value_error("the lighting names lights that the hierarchy does not have: it was made with another");
    if (p.shadow_samples > 0 && p.shadow_points == ShadowPoints::members && h.members.offset.empty() &&
        h.position.size() > h.input_index.size())
        throw py::value_error("the hierarchy was built without members, which shadow_points=members draws from");
    ShadowData s = without_gil([&] { return trace_shadow_rays(scene, h, g, l, p); });
    const py::ssize_t k = p.shadow_samples, channels = s.channels;
    py::dict d;
    d["point"] = to_numpy(std::move(s.point), {g.height, g.width, k});
    d["member"] = to_numpy(std::move(s.member), {g.height, g.width, k});
    d["omega"] = to_numpy(std::move(s.omega), {g.height, g.width, k});
    d["visible"] = to_numpy(std::move(s.visible), {g.height, g.width, k});
    d["shadowed"] = to_numpy(std::move(s.shadowed), {g.height, g.width, channels});
    d["weight"] = to_numpy(std::move(s.weight), {g.height, g.width, channels});
    d["direct"] = to_numpy(std::move(s.direct), {g.height, g.width});
    d["area"] = to_numpy(std::move(s.area), {g.height, g.width});
    d["left_out"] = py::none();
    if (p.compensation == Compensation::path) d["left_out"] = to_numpy(std::move(s.left_out), {g.height, g.width});
    return d;
}

py::dict composite_(const py::object& gbuffer, const py::object& lighting, const py::object& shadows,
                    const py::object& filtered, const py::object& background, const py::dict& params) {
    const Params p = params_from(params);
    const GBufferView g = gbuffer_view(gbuffer);
    const int channels = filtered.attr("shadowed").attr("shape").cast<std::array<int, 3>>()[2];
    if (channels != 1 && channels != 3) throw py::type_error("shadowed: expected shape (H, W, 1) or (H, W, 3)");
    const std::size_t count = g.pixels() * channels;
    const py::object left_out = filtered.attr("left_out");
    const CompositeInput in{view<vec3>(lighting.attr("irradiance"), "irradiance", g.pixels()),
                            view<vec3>(shadows.attr("direct"), "direct", g.pixels()),
                            view<vec3>(filtered.attr("area"), "area", g.pixels()),
                            view<float>(filtered.attr("shadowed"), "shadowed", count),
                            view<float>(filtered.attr("weight"), "weight", count),
                            left_out.is_none() ? std::span<const vec3>{} : view<vec3>(left_out, "left_out", g.pixels()),
                            channels,
                            vec3_from(background)};
    ImageData image = without_gil([&] { return composite(g, in, p); });
    py::dict d;
    d["colour"] = to_numpy(std::move(image.colour), {g.height, g.width});
    d["direct"] = to_numpy(std::move(image.direct), {g.height, g.width});
    d["unshadowed"] = to_numpy(std::move(image.unshadowed), {g.height, g.width});
    d["indirect"] = to_numpy(std::move(image.indirect), {g.height, g.width});
    d["shadow_ratio"] = to_numpy(std::move(image.shadow_ratio), {g.height, g.width, channels});
    return d;
}

}  // namespace

void bind_stages(py::module_& m) {
    m.def("trace_vpls", &trace_vpls_, py::arg("scene"), py::arg("params"));
    m.def("build_hierarchy", &build_hierarchy_, py::arg("lights"), py::arg("params"));
    m.def("build_members", &build_members_, py::arg("hierarchy"), py::arg("params"));
    m.def("s1_sums", &s1_sums_, py::arg("lights"), py::arg("params"));
    m.def("render_gbuffer", &render_gbuffer_, py::arg("scene"), py::arg("camera"), py::arg("width"), py::arg("height"));
    m.def("light", &light_, py::arg("hierarchy"), py::arg("gbuffer"), py::arg("params"), py::arg("scene_radius"),
          py::arg("counts") = true);
    m.def("trace_shadow_rays", &trace_shadow_rays_, py::arg("scene"), py::arg("hierarchy"), py::arg("gbuffer"),
          py::arg("lighting"), py::arg("params"));
    m.def("composite", &composite_, py::arg("gbuffer"), py::arg("lighting"), py::arg("shadows"), py::arg("filtered"),
          py::arg("background"), py::arg("params"));
}

}  // namespace lab::bind
