#include "lab/grid.h"

#include "lab/row_index.h"

namespace lab {

Grid make_grid(std::span<const glm::vec3> positions, float bounds_scale) {
    glm::vec3 low = positions[0], high = positions[0];
    for (const glm::vec3& p : positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const glm::vec3 extent = high - low, largest = glm::max(glm::abs(low), glm::abs(high));
    const float longest = std::max(extent.x, std::max(extent.y, extent.z));
    const float magnitude = std::max(largest.x, std::max(largest.y, largest.z));
    Grid grid;
    grid.top_size = std::max(longest * bounds_scale, std::max(magnitude * 1e-6f, 1e-20f));
    grid.origin = 0.5f * (low + high) - 0.5f * grid.top_size;
    return grid;
}

RowIndex index_rows(std::span<const glm::vec3> positions, const Grid& grid, int level) {
    const auto count = static_cast<std::int64_t>(positions.size());
    RowIndex index;
    index.cells = grid.cells(level);
    std::vector<std::uint32_t> row(positions.size());
#pragma omp parallel for
    for (std::int64_t i = 0; i < count; ++i) {
        const glm::ivec3 cell = grid.locate(positions[i], level).cell;
        row[i] = static_cast<std::uint32_t>(cell.z) * index.cells + cell.y;
    }
    index.begin.assign(static_cast<std::size_t>(index.cells) * index.cells + 1, 0);
    for (const std::uint32_t r : row) ++index.begin[r + 1];
    for (std::size_t r = 1; r < index.begin.size(); ++r) index.begin[r] += index.begin[r - 1];
    index.order.resize(positions.size());
    std::vector<std::uint32_t> next(index.begin.begin(), index.begin.end() - 1);
    for (std::uint32_t i = 0; i < row.size(); ++i) index.order[next[row[i]]++] = i;
    return index;
}

}  // namespace lab
