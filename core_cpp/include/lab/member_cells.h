// Members by cells: the lights in the cells around a vertex, in proportion to trilinear weight times luminance. Level 1
// takes them from S0, level 2 from S1 (gather).
#pragma once

#include <span>
#include <vector>

#include "lab/buffer.h"
#include "lab/grid.h"
#include "lab/records.h"

namespace lab {

// The kept vertices (x, y, z) of one row, ascending.
struct VertexLine {
    int y, z;
    std::span<const Vertex> vertex;
};

// Lights in the order of a level's cells, and what their trilinear weights are made of.
class MemberCells {
  public:
    // Of the lights of level `from`; `half_open`: see Trilinear::end_before_far_face.
    MemberCells(const HierarchyView& h, const Grid& grid, int level, int from, bool half_open);

    // How many members each vertex has.
    void count(const VertexLine& line, std::int64_t* members) const;

    // Merged indices and weights of the members, those of one vertex after the other, which begin at `offset`; there is
    // room for one vector more.
    void fill(const VertexLine& line, const std::int64_t* offset, std::uint32_t* item, double* weight) const;

    static constexpr std::size_t vector = 8;

    // For member_cells.cpp's kernels.
    struct Cell {
        std::uint32_t x, begin;  // its first light
    };
    int cells;                             // along an axis
    std::vector<std::uint32_t> row_begin;  // of cell row z * cells + y: its first cell; one more at the end
    Buffer<Cell> cell;                     // those that hold lights; one more at the end
    Buffer<std::uint32_t> light;           // merged index
    Buffer<float> factor[2][3];            // of the weights: near and far, by axis
    Buffer<float> brightness;

  private:
    struct CellPlace {
        int x, y, z;
        bool operator==(const CellPlace&) const = default;
    };
    template <class PlaceOf>
    void find_cells(std::int64_t lights, const PlaceOf& place_of);
};

// Calls visit(begin, end, far x, far y, far z) for the lights in each of the cells around vertex after vertex of a
// line, and next() after each.
template <class Visit, class Next>
void for_cells_around(const MemberCells& m, const VertexLine& line, const Visit& visit, const Next& next) {
    struct Row {
        const MemberCells::Cell *cell, *end;
        int far_y, far_z;
    } rows[4];
    int count = 0;
    for (int far_z = 1; far_z >= 0; --far_z)  // in the order of the cells
        for (int far_y = 1; far_y >= 0; --far_y) {
            const int y = line.y - far_y, z = line.z - far_z;
            if (y < 0 || z < 0 || y >= m.cells || z >= m.cells) continue;
            const std::size_t row = static_cast<std::size_t>(z) * m.cells + y;
            rows[count++] = {&m.cell[m.row_begin[row]], &m.cell[m.row_begin[row + 1]], far_y, far_z};
        }
    for (const Vertex& v : line.vertex) {
        for (Row* row = rows; row != rows + count; ++row) {
            while (row->cell != row->end && row->cell->x + 1 < v.x) ++row->cell;
            if (row->cell != row->end && row->cell->x + 1 == v.x) {
                visit(row->cell[0].begin, row->cell[1].begin, 1, row->far_y, row->far_z);
                ++row->cell;
            }
            if (row->cell != row->end && row->cell->x == v.x)
                visit(row->cell[0].begin, row->cell[1].begin, 0, row->far_y, row->far_z);
        }
        next();
    }
}

}  // namespace lab
