// Coarser levels from finer ones. A trilinear tent is the sum of the tents of the next finer grid around it, in shares
// of 1, 1/2, 1/4 and 1/8. So the sums of a vertex over S1's lights (LY19 3.1: gather) are such a sum of the finer
// level's, and no light needs to be looked at again.
#pragma once

#include <span>

#include "lab/light_arrays.h"
#include "lab/vertex_sums.h"

namespace lab {

// The vertices of a level by their rows (y, z).
struct VertexGrid {
    int side;  // vertices along an axis
    std::span<const Vertex> vertex;
    std::vector<std::uint32_t> row_begin;  // of row z * side + y; one more at the end

    VertexGrid(const Grid& grid, int level, std::span<const Vertex> vertices);
};

// A finer vertex as one of a coarser level sees it.
struct FinerVertex {
    std::uint32_t index;  // in its level
    int x;                // of the coarser vertex
    int apart[3];         // finer minus twice the coarser: -1, 0 or 1
    float share;          // of it that belongs to the coarser vertex
};

// Calls visit(FinerVertex) for what coarse row (y, z) is made of, in a fixed order.
template <class Visit>
void visit_finer(const VertexGrid& finer, int y, int z, const Visit& visit) {
    const int last = (finer.side - 1) / 2;
    for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
            const int fy = 2 * y + dy, fz = 2 * z + dz;
            if (fy < 0 || fz < 0 || fy >= finer.side || fz >= finer.side) continue;
            const float share = (dz == 0 ? 1.0f : 0.5f) * (dy == 0 ? 1.0f : 0.5f);
            const std::size_t row = static_cast<std::size_t>(fz) * finer.side + fy;
            for (std::uint32_t i = finer.row_begin[row]; i < finer.row_begin[row + 1]; ++i) {
                const int fx = finer.vertex[i].x, x = fx / 2;
                if (fx % 2 == 0) {
                    visit(FinerVertex{i, x, {0, dy, dz}, share});
                } else {
                    visit(FinerVertex{i, x, {1, dy, dz}, 0.5f * share});
                    if (x < last) visit(FinerVertex{i, x + 1, {-1, dy, dz}, 0.5f * share});
                }
            }
        }
}

// Appends the level of `settings` to `lights`, whose rows from `finer_first` on are the next finer level, with the
// sums `finer`. Returns the level's own sums.
Buffer<VertexRow<FloatingPoint>> coarsen(const Buffer<VertexRow<FloatingPoint>>& finer, std::size_t finer_first,
                                         const TermSettings& settings, float flux_scale, LightArrays& lights);

}  // namespace lab
