// The module: it only registers.
#include <omp.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bind.h"
#include "lab/buffer.h"
#include "lab/ray_tracer.h"
#include "lab/simd.h"
#include "lab/trace_vpls.h"
#include "records.h"

namespace py = pybind11;

namespace {

py::dict info() {
    py::dict d;
    d["embree"] = lab::RayTracer::version();
    d["compiler"] = __VERSION__;
    d["simd"] = lab::simd();
    d["simd_choices"] = lab::simd_choices();
    d["openmp"] = _OPENMP;
    d["threads"] = omp_get_max_threads();
    return d;
}

py::dict buffer_bytes() {
    const lab::pool::Usage usage = lab::pool::usage();
    py::dict d;
    d["in_use"] = usage.in_use;
    d["kept"] = usage.kept;
    d["most_in_use"] = usage.most_in_use;
    return d;
}

}  // namespace

PYBIND11_MODULE(_core, m) {
    m.doc() = "The C++ core of the many-lights laboratory: the seven stages of a frame on the CPU.";
    py::register_exception<lab::UnlitScene>(m, "UnlitSceneError");
    m.def("set_threads", [](int threads) { omp_set_num_threads(threads); }, py::arg("threads"));
    m.def("set_simd", &lab::set_simd, py::arg("name"));
    m.def("keep_buffers", &lab::pool::keep,
          "Large blocks are kept for the next frame until as many release_buffers().");
    m.def("release_buffers", &lab::pool::release);
    m.def("buffer_bytes", &buffer_bytes);
    m.def("info", &info);
    m.def("default_params", [] { return lab::bind::params_to_dict(lab::Params{}); });
    m.def("choices", &lab::bind::choices, "The words of each choice setting, as the core knows them.");
    lab::bind::bind_scene(m);
    lab::bind::bind_stages(m);
    lab::bind::bind_filter_shadows(m);
    lab::bind::bind_limits(m);
    lab::bind::bind_references(m);
    lab::bind::bind_pure(m);
    lab::bind::bind_probe(m);
}
