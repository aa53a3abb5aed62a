// What the module registers.
#pragma once

#include <pybind11/pybind11.h>

namespace lab::bind {

void bind_scene(pybind11::module_& m);
void bind_stages(pybind11::module_& m);
void bind_filter_shadows(pybind11::module_& m);
void bind_limits(pybind11::module_& m);
void bind_references(pybind11::module_& m);
void bind_pure(pybind11::module_& m);
void bind_probe(pybind11::module_& m);

}  // namespace lab::bind
