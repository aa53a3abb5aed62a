// Python records (lab/records.py, lab/params.py) to the C++ views of them. Views borrow: the Python object
// must outlive them.
#pragma once

#include <pybind11/pybind11.h>

#include "lab/build_hierarchy.h"
#include "lab/camera.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab::bind {

Params params_from(const pybind11::dict& values);  // of Params.to_core()
pybind11::dict params_to_dict(const Params& params);
pybind11::dict choices();
Camera camera_from(const pybind11::handle& camera);
LightsView lights_view(const pybind11::handle& lights);
HierarchyView hierarchy_view(const pybind11::handle& hierarchy);
GBufferView gbuffer_view(const pybind11::handle& gbuffer);
LightingView lighting_view(const pybind11::handle& lighting, const GBufferView& gbuffer, int samples);

}  // namespace lab::bind
