// Which vertices of a level are kept: those that receive any flux. Held as bits, layer by layer, so that no array is
// as large as the grid.
#pragma once

#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "lab/cell_keys.h"
#include "lab/grid.h"
#include "lab/records.h"

namespace lab {

// The points that a level is built from, by their keys: S0 (input lights) or S1.
struct KeyedPoints {
    const CellKeys& keys;
    std::span<const vec3> position, flux;
    std::span<const Vertex> vertex;  // of S1's lights where the search ends before its far face; else empty
    float flux_scale;
    bool s1;
    bool indirect;  // keys.point says which light a key is of; else they come in the same order

    std::uint32_t point(std::uint32_t i) const { return indirect ? keys.point[i] : i; }
};

class VertexLayers {
  public:
    VertexLayers(const KeyedPoints& points, const Grid& grid, int level);

    // Makes vertex layer z known, and with it the one before, if that was opened just before.
    void open(int z);

    std::uint32_t count(int z) const { return at(z).count; }

    // Corners of cells with lights that got nothing from one of them so far. With these kept as well, coarser levels,
    // whose cells and vertices are fewer, could only keep fewer.
    std::size_t untouched() const { return untouched_; }

    // How many kept vertices of an open layer come before (x, y), in grid order.
    std::uint32_t rank(int z, int x, int y) const {
        const Layer& layer = at(z);
        const std::size_t word = static_cast<std::size_t>(y) * words_ + x / 64;
        const std::uint64_t before = (std::uint64_t{1} << x % 64) - 1;
        return layer.before[word] + static_cast<std::uint32_t>(std::popcount(layer.bits[word] & before));
    }
    bool kept(int z, int x, int y) const {
        return at(z).bits[static_cast<std::size_t>(y) * words_ + x / 64] >> x % 64 & 1;
    }

    // Calls visit(x, y) for the kept vertices of an open layer, in grid order.
    template <class Visit>
    void for_each(int z, const Visit& visit) const {
        const Layer& layer = at(z);
        for (int y = layer.first_row; y < layer.last_row; ++y)
            for (int w = 0; w < words_; ++w)
                for (std::uint64_t bits = layer.bits[static_cast<std::size_t>(y) * words_ + w]; bits != 0;
                     bits &= bits - 1)
                    visit(w * 64 + std::countr_zero(bits), y);
    }

  private:
    struct Layer {
        std::vector<std::uint64_t> bits;    // of vertices, row by row
        std::vector<std::uint32_t> before;  // of each word: how many are kept in all before it
        std::uint32_t count = 0;
        int first_row = 0, last_row = 0;  // that may hold any
    };
    const KeyedPoints& points_;
    const Grid& grid_;
    int level_, cells_, words_;
    std::size_t untouched_ = 0;
    int marked_ = -2;  // the last cell layer that was
    Layer layer_[3];   // of vertices, in turn

    const Layer& at(int z) const { return layer_[z % 3]; }
    Layer& at(int z) { return layer_[z % 3]; }
    void clear(Layer& layer);
    void mark(int cell_layer);
    int exact_corners(std::uint32_t i) const;
};

struct VertexCount {
    std::vector<std::uint32_t> of_layer;
    std::size_t total = 0;
    std::size_t bound = 0;  // no coarser level of the same points has more
};

// How many vertices a level keeps; stops where they come to `most`.
VertexCount count_vertices(const KeyedPoints& points, const Grid& grid, int level,
                           std::size_t most = std::numeric_limits<std::size_t>::max());

}  // namespace lab
