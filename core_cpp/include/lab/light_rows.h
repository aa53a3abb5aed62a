// The lights of one level, to be found by place: runs of neighbours along x, by row (y, z). Memory goes with the
// number of lights, not with the grid.
#pragma once

#include <algorithm>
#include <cstdint>

#include "lab/buffer.h"
#include "lab/records.h"

namespace lab {

struct Box {
    vec3 low, high;
};

class LightRows {
  public:
    LightRows(const HierarchyView& hierarchy, int level);

    // Calls visit(merged index), ascending, for every light whose centre may lie in `box`.
    template <class Visit>
    void find(const Box& box, const Visit& visit) const;

  private:
    struct Row {
        std::uint32_t y, begin;  // begin: merged index
    };
    const HierarchyView& hierarchy_;
    Buffer<Row> rows_;                 // by z, then y; one more at the end
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
    const glm::ivec3 low = glm::max(vertex_of(box.low, -1.0f), glm::ivec3(0));
    const glm::ivec3 high = vertex_of(box.high, 2.0f);
    const Vertex* vertex = hierarchy_.vertex.data();
    for (int z = low.z; z <= std::min(high.z, static_cast<int>(slab_.size()) - 2); ++z) {
        const Row* const end = rows_.data() + slab_[z + 1];
        const Row* row = std::lower_bound(rows_.data() + slab_[z], end, low.y,
                                          [](const Row& r, int y) { return static_cast<int>(r.y) < y; });
        for (; row != end && static_cast<int>(row->y) <= high.y; ++row) {
            const std::uint32_t last = row[1].begin;
            std::uint32_t i = static_cast<std::uint32_t>(
                std::lower_bound(vertex + row->begin, vertex + last, low.x,
                                 [](const Vertex& v, int x) { return static_cast<int>(v.x) < x; }) -
                vertex);
            for (; i != last && static_cast<int>(vertex[i].x) <= high.x; ++i) visit(i);
        }
    }
}

}  // namespace lab
