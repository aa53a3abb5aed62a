#include "lab/light_rows.h"

namespace lab {

LightRows::LightRows(const HierarchyView& hierarchy, int level)
    : hierarchy_(hierarchy), inverse_cell_(1.0f / hierarchy.cell_size[level == 0 ? 1 : level]) {
    // (Level 0 lies in level 1's cells.)
    const auto first = static_cast<std::uint32_t>(hierarchy.offset[level]);
    const auto last = static_cast<std::uint32_t>(hierarchy.offset[level + 1]);
    const Vertex* vertex = hierarchy.vertex.data();
    constexpr std::uint32_t chunk = 1 << 14;
    const std::uint32_t chunks = (last - first + chunk - 1) / chunk;
    std::vector<std::vector<Row>> found(chunks);
#pragma omp parallel for
    for (std::uint32_t c = 0; c < chunks; ++c)
        for (std::uint32_t i = first + c * chunk; i < std::min(last, first + (c + 1) * chunk); ++i)
            if (i == first || vertex[i].y != vertex[i - 1].y || vertex[i].z != vertex[i - 1].z)
                found[c].push_back({vertex[i].y, i});
    for (const std::vector<Row>& rows : found)
        for (const Row& row : rows) {
            while (slab_.size() <= vertex[row.begin].z) slab_.push_back(static_cast<std::uint32_t>(rows_.size()));
            rows_.push_back(row);
        }
    slab_.push_back(static_cast<std::uint32_t>(rows_.size()));
    rows_.push_back({0, last});
}

}  // namespace lab
