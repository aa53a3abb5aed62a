// The references: path tracer, brute force, and what the clamped falloff leaves out.
#include <pybind11/pybind11.h>

#include <limits>
#include <optional>

#include "arrays.h"
#include "bind.h"
#include "lab/brute_force.h"
#include "lab/trace_paths.h"
#include "records.h"

namespace lab::bind {
namespace {

SampleRange sample_range(std::uint32_t first, std::uint32_t count) {
    if (count > std::numeric_limits<std::uint32_t>::max() - first) throw py::value_error("samples: too many");
    return {first, count};
}

void add_sums(py::dict& d, const std::string& name, SampleSums&& sums, const GBufferView& g) {
    d[name.c_str()] = to_numpy(std::move(sums.sum), {g.height, g.width});
    d[(name + "_square").c_str()] = to_numpy(std::move(sums.square), {g.height, g.width});
}

py::dict trace_paths_(const Scene& scene, const py::object& light_list, const py::object& gbuffer,
                      const py::object& camera, std::uint32_t first, std::uint32_t count, const py::dict& params) {
    const Params p = params_from(params);
    const GBufferView g = gbuffer_view(gbuffer);
    const LightsView list = light_list.is_none() ? LightsView{} : lights_view(light_list);
    const std::optional<Camera> c = camera.is_none() ? std::nullopt : std::optional(camera_from(camera));
    const SampleRange samples = sample_range(first, count);
    PathSums sums = without_gil([&] { return trace_paths(scene, list, g, c, samples, p); });
    py::dict d;
    add_sums(d, "direct", std::move(sums.direct), g);
    add_sums(d, "indirect", std::move(sums.indirect), g);
    add_sums(d, "colour", std::move(sums.colour), g);
    return d;
}

py::dict trace_compensation_(const Scene& scene, const py::object& gbuffer, std::uint32_t first, std::uint32_t count,
                             const py::dict& params) {
    const Params p = params_from(params);
    const GBufferView g = gbuffer_view(gbuffer);
    const SampleRange samples = sample_range(first, count);
    SampleSums sums = without_gil([&] { return trace_compensation(scene, g, samples, p); });
    py::dict d;
    add_sums(d, "irradiance", std::move(sums), g);
    return d;
}

py::dict brute_force_(const Scene& scene, const py::object& lights, const py::object& gbuffer, int first_row,
                      int last_row, int draws, std::uint32_t pass, const py::dict& params) {
    const Params p = params_from(params);
    const GBufferView g = gbuffer_view(gbuffer);
    const LightsView in = lights_view(lights);
    if (first_row < 0 || last_row > g.height || first_row > last_row)
        throw py::value_error("rows: outside of the image");
    if (draws < 0) throw py::value_error("draws: expected 0 or more");
    const RowRange rows{first_row, last_row};
    BruteForceData found = without_gil([&] { return brute_force(scene, in, g, rows, draws, pass, p); });
    const py::ssize_t height = last_row - first_row;
    py::dict d;
    d["unshadowed"] = to_numpy(std::move(found.unshadowed), {height, g.width});
    d["irradiance"] = to_numpy(std::move(found.irradiance), {height, g.width});
    d["variance"] = to_numpy(std::move(found.variance), {height, g.width});
    d["exact_pixels"] = found.exact_pixels;
    return d;
}

}  // namespace

void bind_references(py::module_& m) {
    m.def("trace_paths", &trace_paths_, py::arg("scene"), py::arg("light_list"), py::arg("gbuffer"), py::arg("camera"),
          py::arg("first"), py::arg("count"), py::arg("params"));
    m.def("trace_compensation", &trace_compensation_, py::arg("scene"), py::arg("gbuffer"), py::arg("first"),
          py::arg("count"), py::arg("params"));
    m.def("brute_force", &brute_force_, py::arg("scene"), py::arg("lights"), py::arg("gbuffer"), py::arg("first_row"),
          py::arg("last_row"), py::arg("draws"), py::arg("pass_number"), py::arg("params"));
}

}  // namespace lab::bind
