// Stage build_hierarchy: the lighting grid hierarchy of a set of lights (LY19 3.1).
#pragma once

#include "lab/light_arrays.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// The merged levels; see Hierarchy in lab/records.py for the meaning and shape of each.
struct HierarchyData {
    vec3 origin;
    std::vector<float> cell_size;
    std::vector<std::int64_t> offset;
    LightArrays lights;
    Buffer<std::uint32_t> input_index;
};

HierarchyData build_hierarchy(const LightsView& lights, const Params& params);

}  // namespace lab
