// Stage build_hierarchy: the lighting grid hierarchy of a set of lights (LY19 3.1).
#pragma once

#include "lab/alias_table.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// The merged levels as vectors; see Hierarchy in lab/records.py for the meaning and shape of each.
struct HierarchyData {
    vec3 origin;
    std::vector<float> cell_size;
    std::vector<std::int64_t> offset;
    std::vector<vec3> position, flux, normal;
    std::vector<Symmetric> normal_moment;
    std::vector<vec3> deviation;
    std::vector<Vertex> vertex;
    std::vector<std::uint8_t> oriented;
    std::vector<std::uint32_t> input_index;
    std::vector<std::int64_t> member_offset;  // empty without members
    std::vector<AliasSlot> member;
};

HierarchyData build_hierarchy(const LightsView& lights, const Params& params, bool with_members);

}  // namespace lab
