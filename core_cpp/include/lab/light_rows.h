// The lights of one level (or one interleaving tile's share of it), to be found by place: runs of neighbours
// along x, by row (y, z). Memory goes with the number of lights, not with the grid.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lab/records.h"

namespace lab {

struct Box {
    vec3 low, high;
};

class LightRows {
  public:
    // `lights`: merged indices, ascending (which is grid order, x fastest).
    LightRows(const HierarchyView& hierarchy, std::vector<std::uint32_t> lights, float cell_size);

    // Calls visit(merged index), ascending, for every light whose centre may lie in `box`.
    template <class Visit>
    void find(const Box& box, const Visit& visit) const;
    const std::vector<std::uint32_t>& lights() const { return lights_; }

  private:
    struct Row {
        std::uint16_t y;
        std::uint32_t begin;
    };
    const HierarchyView& hierarchy_;
    std::vector<std::uint32_t> lights_;
    std::vector<std::uint16_t> x_;     // of each light
    std::vector<Row> rows_;            // by z, then y; one more at the end
    std::vector<std::uint32_t> slab_;  // first row of each z; one more at the end
    float inverse_cell_;

    glm::ivec3 vertex_of(const vec3& p, float slack) const;
};

inline glm::ivec3 LightRows::vertex_of(const vec3& p, float slack) const {
    // A light lies within one cell of its vertex (level 0: in its cell); one more absorbs rounding.
    const vec3 u = (p - hierarchy_.origin) * inverse_cell_ + slack;
    const vec3 limited = glm::clamp(u, vec3(-1.0f), vec3(65536.0f));
    return glm::ivec3(glm::floor(limited));
}

template <class Visit>
void LightRows::find(const Box& box, const Visit& visit) const {
    if (lights_.empty()) return;
    const glm::ivec3 low = glm::max(vertex_of(box.low, -1.0f), glm::ivec3(0));
    const glm::ivec3 high = vertex_of(box.high, 2.0f);
    for (int z = low.z; z <= std::min(high.z, static_cast<int>(slab_.size()) - 2); ++z) {
        auto row = std::lower_bound(rows_.begin() + slab_[z], rows_.begin() + slab_[z + 1], low.y,
                                    [](const Row& r, int y) { return r.y < y; });
        for (; row != rows_.begin() + slab_[z + 1] && row->y <= high.y; ++row) {
            const auto end = x_.begin() + (row + 1)->begin;
            auto x = std::lower_bound(x_.begin() + row->begin, end, low.x);
            for (; x != end && *x <= high.x; ++x) visit(lights_[x - x_.begin()]);
        }
    }
}

}  // namespace lab
