// The nested grids of a hierarchy: one cube, halved level by level (LY19 3.1).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "lab/records.h"

namespace lab {

// Where a point lies in a level's grid: its cell, and the place inside it in [0, 1].
struct CellPoint {
    glm::ivec3 cell;
    glm::vec3 fraction;
};

// Level l (1..top) has cells(l) = 2^(top - l) cells and one more vertex along each axis; all levels share a
// corner.
struct Grid {
    glm::vec3 origin{0.0f};
    float top_size = 1.0f;
    int top = 1;

    int cells(int level) const { return 1 << (top - level); }
    float cell_size(int level) const { return top_size / static_cast<float>(cells(level)); }

    // The float operations here decide S1's integers: they are the same on every engine (no contraction).
    CellPoint locate(const glm::vec3& p, int level) const {
        const float inverse = 1.0f / cell_size(level);
        const int last = cells(level) - 1;
        CellPoint at;
        for (int axis = 0; axis < 3; ++axis) {
            const float u = (p[axis] - origin[axis]) * inverse;
            const int cell = std::clamp(static_cast<int>(std::floor(u)), 0, last);
            at.cell[axis] = cell;  // a light on the far face belongs to the last cell
            at.fraction[axis] = std::clamp(u - static_cast<float>(cell), 0.0f, 1.0f);
        }
        return at;
    }
};

// The eight corners of a cell: bits 0, 1 and 2 of a corner's number are its x, y and z.
inline constexpr int corners = 8;

// A point's trilinear weights at them, as products of one factor an axis.
struct Trilinear {
    glm::ivec3 cell;
    float factor[2][3];  // of the near and the far face

    Trilinear(const Grid& grid, const glm::vec3& p, int level) {
        const CellPoint at = grid.locate(p, level);
        cell = at.cell;
        for (int axis = 0; axis < 3; ++axis) {
            factor[0][axis] = 1.0f - at.fraction[axis];
            factor[1][axis] = at.fraction[axis];
        }
    }

    // The demo's search range ends before its far face (`half_open`): a light of the S1 vertex `v` that lies on that
    // face gives nothing to the vertices before it. `stride`: of this level's vertices, in S1's.
    void end_before_far_face(const Vertex& v, int stride) {
        const int of[3] = {v.x, v.y, v.z};
        for (int axis = 0; axis < 3; ++axis)
            if (of[axis] == (cell[axis] + 1) * stride) factor[0][axis] = 0.0f;
    }

    float weight(int corner) const {
        return factor[corner & 1][0] * factor[corner >> 1 & 1][1] * factor[corner >> 2][2];
    }
};

// The cube around all lights: longest edge * scale, never below what their coordinates can resolve.
Grid make_grid(std::span<const glm::vec3> positions, float bounds_scale);

}  // namespace lab
