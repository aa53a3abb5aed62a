// Points in the order of their grid cells. One key a point holds its place for every level at once: cells are nested,
// so a coarser cell is the leading bits of a finer one.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lab/buffer.h"
#include "lab/grid.h"
#include "lab/params.h"

namespace lab {

inline constexpr int key_bits = 21;  // of a coordinate: the cell of any level, and where in it
inline constexpr int layer_bits = max_levels - 1;

struct CellKey {
    std::uint64_t bits;

    // z, y and x from the most significant bit down, so that keys cut to a level's cells are in grid order.
    std::uint32_t coordinate(int axis) const {
        return static_cast<std::uint32_t>(bits >> (axis * key_bits)) & ((1u << key_bits) - 1);
    }
    int cell(int axis, int shift) const { return static_cast<int>(coordinate(axis) >> shift); }

    // Set for points that are weak enough for a weight to round them away.
    bool dim() const { return bits >> 63 != 0; }
};

// From a coordinate's bits to the cells of a level: shift right by so much.
inline int cell_shift(const Grid& grid, int level) {
    return key_bits - (grid.top - level);
}

struct CellKeys {
    Buffer<CellKey> key;
    Buffer<std::uint32_t> point;       // which point each key is of
    std::vector<std::uint32_t> layer;  // of the finest possible grid: where each layer of cells starts, and the end

    // Where the points of cell layer z of a level lie; none outside of the grid.
    std::pair<std::uint32_t, std::uint32_t> range(const Grid& grid, int level, int z) const {
        if (z < 0 || z >= grid.cells(level)) return {0, 0};
        const int shift = layer_bits - (grid.top - level);
        return {layer[static_cast<std::size_t>(z) << shift], layer[static_cast<std::size_t>(z + 1) << shift]};
    }
};

// Brightness under which a light counts as dim, relative to the flux scale.
inline constexpr float dim_flux = 0x1p-12f;

// Keys of points by layers of cells, in their given order inside a layer. Those whose brightest `flux` is under
// `dim_below` are marked.
CellKeys cell_keys(std::span<const glm::vec3> position, std::span<const glm::vec3> flux, float dim_below,
                   const Grid& grid);

// Puts the keys of each layer into the order of their cells in `level`; ties stay in order. From then on range() holds
// for this level and coarser ones.
void sort_cells(CellKeys& keys, const Grid& grid, int level);

// Cuts the vertex layers of a level into runs with about the same number of points: first layers, and the end.
std::vector<int> cut_layers(const CellKeys& keys, const Grid& grid, int level);

}  // namespace lab
