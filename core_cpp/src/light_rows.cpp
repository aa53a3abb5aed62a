#include "lab/light_rows.h"

namespace lab {

LightRows::LightRows(const HierarchyView& hierarchy, std::vector<std::uint32_t> lights, float cell_size)
    : hierarchy_(hierarchy), lights_(std::move(lights)), inverse_cell_(1.0f / cell_size) {
    int z = -1;
    for (std::uint32_t i = 0; i < lights_.size(); ++i) {
        const Vertex v = hierarchy_.vertex[lights_[i]];
        x_.push_back(v.x);
        const bool new_slab = v.z != z;
        while (z < v.z) {
            slab_.push_back(static_cast<std::uint32_t>(rows_.size()));
            ++z;
        }
        if (new_slab || rows_.back().y != v.y) rows_.push_back({v.y, i});
    }
    slab_.push_back(static_cast<std::uint32_t>(rows_.size()));
    rows_.push_back({0, static_cast<std::uint32_t>(lights_.size())});
}

}  // namespace lab
