#include "lab/filter_shadows.h"

#include "arrays.h"
#include "records.h"

namespace lab::bind {

void bind_filter_shadows(py::module_& m) {
    m.def(
        "filter_shadows",
        [](const py::object& gbuffer, const py::array& shadowed, const py::array& weight, const py::array& area,
           const py::dict& params, float scene_radius) {
            const auto view_of_gbuffer = gbuffer_view(gbuffer);
            const auto pixels = view_of_gbuffer.pixels();
            const auto channels = shadowed.ndim() == 3 ? shadowed.shape(2) : 0;
            if (channels != 1 && channels != 3) throw py::type_error("shadowed: expected shape (H, W, 1) or (H, W, 3)");
            const ShadowSignalView signal{
                static_cast<int>(channels), view<float>(shadowed, "shadowed", pixels * channels),
                view<float>(weight, "weight", pixels * channels), view<vec3>(area, "area", pixels)};
            const auto settings = params_from(params);
            ShadowSignal filtered;
            {
                const py::gil_scoped_release release;
                filtered = filter_shadows(view_of_gbuffer, signal, settings, scene_radius);
            }
            const std::vector<py::ssize_t> size{view_of_gbuffer.height, view_of_gbuffer.width};
            const std::vector<py::ssize_t> shape{size[0], size[1], channels};
            return py::make_tuple(to_numpy(std::move(filtered.shadowed), shape),
                                  to_numpy(std::move(filtered.weight), shape),
                                  to_numpy(std::move(filtered.area), size));
        },
        py::arg("gbuffer"), py::arg("shadowed"), py::arg("weight"), py::arg("area"), py::arg("params"),
        py::arg("scene_radius"),
        "Edge-stopping filter of S, its weight (H, W, c) and the area lights' irradiance (H, W, 3).");
    m.def(
        "filter_irradiance",
        [](const py::object& gbuffer, const py::object& irradiance, const py::dict& params, float scene_radius) {
            const GBufferView g = gbuffer_view(gbuffer);
            const auto light = view<vec3>(irradiance, "irradiance", g.pixels());
            const Params p = params_from(params);
            auto filtered = without_gil([&] { return filter_irradiance(g, light, p, scene_radius); });
            return to_numpy(std::move(filtered), {g.height, g.width});
        },
        py::arg("gbuffer"), py::arg("irradiance"), py::arg("params"), py::arg("scene_radius"),
        "The same filter on noisy irradiance (H, W, 3).");
}

}  // namespace lab::bind
