// What a grid vertex accumulates from the lights around it (LY19 3.1), one row of numbers a vertex.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "lab/grid.h"
#include "lab/light_arrays.h"

namespace lab {

// Input lights are summed in 64-bit fixed point: integer sums don't depend on order, so S1 is bit-identical for any
// thread count and order of the lights. Every term is at most 1 in magnitude: ten million lights stay under 2^56, and
// 2^31 of them still fit. The other side of it: light under 2^-32 of the brightest light's is lost from S1 up.
// Gathered levels are summed in double, in a fixed order.
struct FixedPoint {
    using Sum = std::int64_t;
    static Sum term(float x) { return std::llrint(static_cast<double>(x) * 0x1p32); }
};

struct FloatingPoint {
    using Sum = double;
};

// The columns of a row. Flux is relative to the set's scale, lengths are in cells and relative to the vertex. From
// `moment_weight` on, terms are weighted by luminance too (or by weight alone). `oriented` counts what has normals.
namespace column {
inline constexpr int flux = 0, weight = 3, moment_weight = 4, normal = 5, normal_moment = 8, oriented = 14,
                     position = 16, square = 20, count = 24;
}

template <class Number>
struct alignas(64) VertexRow {
    typename Number::Sum sum[column::count];
};

// One light as its vertices see it: what is to be weighted, and how, corner by corner.
struct alignas(64) LightTerms {
    float term[column::position];  // columns before the position's
    float place[2][8];             // the others: seen from the near and from the far face of the cell
    float weight[corners];         // trilinear; for fixed point in its steps
    float moment_weight[corners];  // times luminance
};

// The lights that a level is built from: rows of the merged arrays, S0 or S1.
struct LevelSource {
    const LightArrays& lights;
    std::size_t first, count;
    std::span<const float> weight;  // of S1's lights: sum of trilinear weights; empty for S0, where it is 1
    float flux_scale;               // power of two above every flux of S0
    bool half_open;                 // the search ends before its far face

    bool s1() const { return !weight.empty(); }
};

struct TermSettings {
    Grid grid;
    int level;
    bool carry_moments, by_luminance;
};

// The terms of source lights `index`, in their order.
void prepare_terms(const LevelSource& source, const TermSettings& settings, std::span<const std::uint32_t> index,
                   LightTerms* out);

// A run of lights in one cell, and the vertex rows that they add to.
template <class Number>
struct CellRun {
    std::uint32_t begin, end;
    VertexRow<Number>* row[corners];
};

void add_cells(const LightTerms* lights, std::span<const CellRun<FixedPoint>> runs);
void add_cells(const LightTerms* lights, std::span<const CellRun<FloatingPoint>> runs);

// The grid lights of vertex rows, written to the rows of `out` from `first` on, and their trilinear weights to `weight`
// unless that is null.
void finish_lights(std::span<const VertexRow<FixedPoint>> rows, std::span<const Vertex> vertices,
                   const TermSettings& settings, float flux_scale, LightArrays& out, std::size_t first, float* weight);
void finish_lights(std::span<const VertexRow<FloatingPoint>> rows, std::span<const Vertex> vertices,
                   const TermSettings& settings, float flux_scale, LightArrays& out, std::size_t first, float* weight);

}  // namespace lab
