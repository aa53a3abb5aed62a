// The module: it only registers.
#include <omp.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bind.h"
#include "lab/ray_tracer.h"
#include "lab/trace_vpls.h"
#include "records.h"

namespace py = pybind11;

namespace {

#if defined(__AVX512F__)
constexpr const char* simd = "AVX-512";
#elif defined(__AVX2__)
constexpr const char* simd = "AVX2";
#elif defined(__SSE4_2__)
constexpr const char* simd = "SSE4.2";
#elif defined(__ARM_NEON)
constexpr const char* simd = "NEON";
#else
constexpr const char* simd = "baseline";
#endif

py::dict info() {
    py::dict d;
    d["embree"] = lab::RayTracer::version();
    d["compiler"] = __VERSION__;
    d["simd"] = simd;
    d["openmp"] = _OPENMP;
    d["threads"] = omp_get_max_threads();
    return d;
}

}  // namespace

PYBIND11_MODULE(_core, m) {
    m.doc() = "The C++ core of the many-lights laboratory: the seven stages of a frame on the CPU.";
    py::register_exception<lab::UnlitScene>(m, "UnlitSceneError");
    m.def("set_threads", [](int threads) { omp_set_num_threads(threads); }, py::arg("threads"));
    m.def("info", &info);
    m.def("default_params", [] { return lab::bind::params_to_dict(lab::Params{}); });
    m.def("choices", &lab::bind::choices, "The words of each choice setting, as the core knows them.");
    lab::bind::bind_scene(m);
    lab::bind::bind_stages(m);
    lab::bind::bind_filter_shadows(m);
    lab::bind::bind_references(m);
    lab::bind::bind_pure(m);
}
