// The machine's limits, for lab/bench.
#include "lab/limits.h"

#include "arrays.h"
#include "bind.h"
#include "lab/limit_light.h"
#include "lab/limit_rays.h"
#include "records.h"

namespace lab::bind {
namespace {

double stream_rate_(std::size_t bytes, int passes) {
    return without_gil([&] { return stream_rate(bytes, passes); });
}

template <LightKernel kernel>
double light_rate(const py::object& hierarchy, const py::object& gbuffer, const py::dict& params, float scene_radius,
                  double seconds) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    const GBufferView g = gbuffer_view(gbuffer);
    return without_gil([&] { return light_kernel_rate(kernel, h, g, p, scene_radius, seconds); });
}

template <LightKernel kernel>
py::array light_sums(const py::object& hierarchy, const py::object& gbuffer, const py::dict& params,
                     float scene_radius) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    const GBufferView g = gbuffer_view(gbuffer);
    return to_numpy(without_gil([&] { return light_kernel_sums(kernel, h, g, p, scene_radius); }));
}

py::dict ray_limit(const RayLimit& limit) {
    py::dict d;
    d["rays"] = limit.rays;
    d["seconds"] = limit.seconds;
    return d;
}

py::dict limit_vpl_rays_(const Scene& scene, const py::dict& params, int repetitions) {
    const Params p = params_from(params);
    return ray_limit(without_gil([&] { return limit_vpl_rays(scene, p, repetitions); }));
}

py::dict limit_gbuffer_rays_(const Scene& scene, const py::object& camera, int width, int height, int repetitions) {
    const Camera c = camera_from(camera);
    return ray_limit(without_gil([&] { return limit_gbuffer_rays(scene, c, width, height, repetitions); }));
}

py::dict limit_shadow_rays_(const Scene& scene, const py::object& hierarchy, const py::object& gbuffer,
                            const py::object& lighting, const py::dict& params, int repetitions) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    const GBufferView g = gbuffer_view(gbuffer);
    const LightingView l = lighting_view(lighting, g, p.shadow_samples);
    return ray_limit(without_gil([&] { return limit_shadow_rays(scene, h, g, l, p, repetitions); }));
}

}  // namespace

void bind_limits(py::module_& m) {
    m.def("stream_rate", &stream_rate_, py::arg("bytes"), py::arg("passes"),
          "Bytes a second of all threads reading an array of so many bytes once.");
    m.def("light_kernel_rate", &light_rate<LightKernel::own>, py::arg("hierarchy"), py::arg("gbuffer"),
          py::arg("params"), py::arg("scene_radius"), py::arg("seconds") = 0.2,
          "Pairs of pixel and light a second of the stage's own kernel on perfect lists.");
    m.def("plain_light_rate", &light_rate<LightKernel::plain>, py::arg("hierarchy"), py::arg("gbuffer"),
          py::arg("params"), py::arg("scene_radius"), py::arg("seconds") = 0.2, "The same of a plain kernel.");
    m.def("light_kernel_sums", &light_sums<LightKernel::own>, py::arg("hierarchy"), py::arg("gbuffer"),
          py::arg("params"), py::arg("scene_radius"), "What light_kernel_rate finds: irradiance, (pixels, 3).");
    m.def("plain_light_sums", &light_sums<LightKernel::plain>, py::arg("hierarchy"), py::arg("gbuffer"),
          py::arg("params"), py::arg("scene_radius"), "What plain_light_rate finds: irradiance, (pixels, 3).");
    m.def("limit_vpl_rays", &limit_vpl_rays_, py::arg("scene"), py::arg("params"), py::arg("repetitions"),
          "Embree alone on the rays of trace_vpls: how many, and seconds on all threads (median).");
    m.def("limit_gbuffer_rays", &limit_gbuffer_rays_, py::arg("scene"), py::arg("camera"), py::arg("width"),
          py::arg("height"), py::arg("repetitions"),
          "Embree alone on the rays of render_gbuffer: how many, and seconds on all threads (median).");
    m.def("limit_shadow_rays", &limit_shadow_rays_, py::arg("scene"), py::arg("hierarchy"), py::arg("gbuffer"),
          py::arg("lighting"), py::arg("params"), py::arg("repetitions"),
          "Embree alone on the rays of trace_shadow_rays: how many, and seconds on all threads (median).");
}

}  // namespace lab::bind
