#include "lab/coarsen.h"

#include <algorithm>
#include <numeric>

namespace lab {
namespace {

using Row = VertexRow<FloatingPoint>;

// Adds a finer vertex' sums to a coarser one's, whose cells are twice as large and whose origin is elsewhere.
void add_finer(const Row& finer, const FinerVertex& at, Row& coarser) {
    const double share = at.share, weight = finer.sum[column::moment_weight];
    for (int c = 0; c < column::position; ++c) coarser.sum[c] += share * finer.sum[c];
    for (int axis = 0; axis < 3; ++axis) {
        const double apart = at.apart[axis], offset = finer.sum[column::position + axis];
        coarser.sum[column::position + axis] += share * 0.5 * (offset + apart * weight);
        coarser.sum[column::square + axis] +=
            share * 0.25 * (finer.sum[column::square + axis] + apart * (2.0 * offset + apart * weight));
    }
}

}  // namespace

VertexGrid::VertexGrid(const Grid& grid, int level, std::span<const Vertex> vertices)
    : side(grid.cells(level) + 1), vertex(vertices), row_begin(static_cast<std::size_t>(side) * side + 1) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const std::size_t row = static_cast<std::size_t>(vertices[i].z) * side + vertices[i].y;
        while (next <= row) row_begin[next++] = static_cast<std::uint32_t>(i);
    }
    while (next < row_begin.size()) row_begin[next++] = static_cast<std::uint32_t>(vertices.size());
}

Buffer<Row> coarsen(const Buffer<Row>& finer, std::size_t finer_first, const TermSettings& settings, float flux_scale,
                    LightArrays& lights) {
    const int side = settings.grid.cells(settings.level) + 1;
    const std::int64_t rows = static_cast<std::int64_t>(side) * side;
    std::vector<std::uint32_t> before(rows + 1, 0);
    {
        const VertexGrid grid(settings.grid, settings.level - 1, {lights.vertex.data() + finer_first, finer.size()});
#pragma omp parallel
        {
            std::vector<std::uint8_t> kept(side);
#pragma omp for schedule(dynamic, 16)
            for (std::int64_t row = 0; row < rows; ++row) {
                std::uint32_t count = 0;
                visit_finer(grid, static_cast<int>(row % side), static_cast<int>(row / side),
                            [&](const FinerVertex& at) {
                                count += 1 - kept[at.x];
                                kept[at.x] = 1;
                            });
                before[row + 1] = count;
                if (count > 0) std::fill(kept.begin(), kept.end(), std::uint8_t{0});
            }
        }
    }
    std::partial_sum(before.begin(), before.end(), before.begin());
    const std::size_t first = lights.size();
    Buffer<Row> sums(before.back());
    lights.resize(first + sums.size());
    const VertexGrid grid(settings.grid, settings.level - 1, {lights.vertex.data() + finer_first, finer.size()});
#pragma omp parallel
    {
        std::vector<Row> line(side);
        std::vector<std::uint8_t> kept(side);
        std::vector<Vertex> vertices;
#pragma omp for schedule(dynamic, 16)
        for (std::int64_t row = 0; row < rows; ++row) {
            if (before[row] == before[row + 1]) continue;
            const int y = static_cast<int>(row % side), z = static_cast<int>(row / side);
            visit_finer(grid, y, z, [&](const FinerVertex& at) {
                if (!kept[at.x]) line[at.x] = Row{};
                kept[at.x] = 1;
                add_finer(finer[at.index], at, line[at.x]);
            });
            vertices.clear();
            for (int x = 0; x < side; ++x)
                if (kept[x]) {
                    sums[before[row] + vertices.size()] = line[x];
                    vertices.push_back(
                        {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(z)});
                    kept[x] = 0;
                }
            finish_lights({sums.data() + before[row], vertices.size()}, vertices, settings, flux_scale, lights,
                          first + before[row], nullptr);
        }
    }
    return sums;
}

}  // namespace lab
