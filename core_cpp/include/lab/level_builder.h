// Builds one level of the hierarchy from the lights of S0 or S1, which is where scatter and gather of LY19 3.1 differ.
// Layers of vertices are swept in turn; each is owned by one thread, so nothing needs atomics.
#pragma once

#include "lab/cell_keys.h"
#include "lab/light_arrays.h"
#include "lab/vertex_layers.h"
#include "lab/vertex_sums.h"

namespace lab {

// Where a level goes.
struct LevelTarget {
    LightArrays& lights;
    std::size_t first;                                 // row of its first light
    Buffer<float>* weight = nullptr;                   // takes trilinear weights, for the level to be a source itself
    Buffer<VertexRow<FloatingPoint>>* rows = nullptr;  // takes the sums, for coarsen()
    Buffer<VertexRow<FixedPoint>>* fixed_rows = nullptr;  // takes those of S0's lights, to be compared
};

// Writes the level's kept vertices, in grid order, to the target, which has the room. `points` are the keyed lights of
// `source`, by cells of this level or of a finer one; `count`: kept vertices of each layer.
void build_level(const LevelSource& source, const KeyedPoints& points, std::span<const std::uint32_t> count,
                 const TermSettings& settings, const LevelTarget& target);

}  // namespace lab
