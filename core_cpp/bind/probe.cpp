// Why a pixel is lit as it is, and what a grid light is made of.
#include <pybind11/pybind11.h>

#include "arrays.h"
#include "bind.h"
#include "lab/member_shares.h"
#include "lab/probe_pixel.h"
#include "records.h"

namespace lab::bind {
namespace {

py::dict probe_pixel_(const py::object& hierarchy, const py::object& position, const py::object& normal, int tile,
                      const py::dict& params, float scene_radius) {
    const Params p = params_from(params);
    const HierarchyView h = hierarchy_view(hierarchy);
    const ProbePoint at{vec3_from(position), vec3_from(normal), tile};
    ProbeData found = without_gil([&] { return probe_pixel(h, at, p, scene_radius); });
    py::dict d;
    d["index"] = to_numpy(std::move(found.index));
    d["level"] = to_numpy(std::move(found.level));
    d["distance"] = to_numpy(std::move(found.distance));
    d["blend_weight"] = to_numpy(std::move(found.blend));
    d["receiver_cosine"] = to_numpy(std::move(found.cosine));
    d["emission"] = to_numpy(std::move(found.emission));
    d["falloff"] = to_numpy(std::move(found.falloff));
    d["scale"] = to_numpy(std::move(found.scale));
    d["bright"] = to_numpy(std::move(found.bright));
    d["contribution"] = to_numpy(std::move(found.contribution));
    d["overdraw"] = to_numpy(std::move(found.overdraw));
    d["lights_used"] = to_numpy(std::move(found.lights_used));
    d["first_pick"] = found.first_pick;
    return d;
}

HierarchyView with_members(const py::object& hierarchy) {
    const HierarchyView h = hierarchy_view(hierarchy);
    if (h.members.offset.empty()) throw py::value_error("hierarchy: it was built without members");
    return h;
}

py::tuple member_shares_(const py::object& hierarchy, std::uint32_t index) {
    const HierarchyView h = with_members(hierarchy);
    if (index >= h.position.size()) throw py::value_error("index: there is no such light");
    MemberShares found = without_gil([&] { return member_shares(h, index); });
    return py::make_tuple(to_numpy(std::move(found.member)), to_numpy(std::move(found.share)));
}

// (m,) float64 -> (n,) float64.
py::array member_sums_(const py::object& hierarchy, const py::object& weight) {
    const HierarchyView h = with_members(hierarchy);
    const auto in = view<double>(weight, "weight", h.position.size());
    return to_numpy(without_gil([&] { return member_sums(h, {in.begin(), in.end()}); }));
}

// (n, c) float64 -> (m, c) float64.
py::array member_means_(const py::object& hierarchy, const py::object& values) {
    const HierarchyView h = with_members(hierarchy);
    const auto in = view<double>(values, "values");
    const std::size_t inputs = h.input_index.size(), columns = in.size() / inputs;
    if (in.size() != inputs * columns) throw py::type_error("values: expected (n, c), a row for each input light");
    std::vector<double> mean = without_gil([&] { return member_means(h, in, columns); });
    return to_numpy(std::move(mean), {static_cast<py::ssize_t>(h.position.size()), static_cast<py::ssize_t>(columns)});
}

}  // namespace

void bind_probe(py::module_& m) {
    m.def("probe_pixel", &probe_pixel_, py::arg("hierarchy"), py::arg("position"), py::arg("normal"), py::arg("tile"),
          py::arg("params"), py::arg("scene_radius"));
    m.def("member_shares", &member_shares_, py::arg("hierarchy"), py::arg("index"));
    m.def("member_sums", &member_sums_, py::arg("hierarchy"), py::arg("weight"));
    m.def("member_means", &member_means_, py::arg("hierarchy"), py::arg("values"));
}

}  // namespace lab::bind
