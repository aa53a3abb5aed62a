// Points sorted by the row (y, z) of their grid cell: the owner of a vertex row finds its lights in four
// rows.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lab/grid.h"

namespace lab {

struct RowIndex {
    int cells = 0;
    std::vector<std::uint32_t> begin;  // of row z * cells + y; one more at the end
    std::vector<std::uint32_t> order;  // points by row, in their given order inside a row

    std::span<const std::uint32_t> row(int y, int z) const {
        const std::size_t r = static_cast<std::size_t>(z) * cells + y;
        return {order.data() + begin[r], begin[r + 1] - begin[r]};
    }
};

RowIndex index_rows(std::span<const glm::vec3> positions, const Grid& grid, int level);

}  // namespace lab
