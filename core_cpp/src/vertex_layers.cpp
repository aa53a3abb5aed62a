#include "lab/vertex_layers.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "lab/vertex_sums.h"

namespace lab {

static_assert(std::endian::native == std::endian::little);

VertexLayers::VertexLayers(const KeyedPoints& points, const Grid& grid, int level)
    : points_(points), grid_(grid), level_(level), cells_(grid.cells(level)), words_(cells_ / 64 + 1) {
    for (Layer& layer : layer_) {
        layer.bits.assign(static_cast<std::size_t>(cells_ + 1) * words_ + 1, 0);  // bits are set two bytes at a time
        layer.before.resize(layer.bits.size());
    }
}

void VertexLayers::clear(Layer& layer) {
    if (layer.first_row < layer.last_row)
        std::fill(layer.bits.begin() + static_cast<std::ptrdiff_t>(layer.first_row) * words_,
                  layer.bits.begin() + static_cast<std::ptrdiff_t>(layer.last_row) * words_, 0);
    layer.first_row = cells_ + 1;
    layer.last_row = 0;
    layer.count = 0;
}

// The corners of its cell that light i gives flux to, as bits: what it adds there is not rounded to zero.
int VertexLayers::exact_corners(std::uint32_t i) const {
    const std::uint32_t light = points_.point(i);
    Trilinear place(grid_, points_.position[light], level_);
    if (!points_.vertex.empty()) place.end_before_far_face(points_.vertex[light], 1 << (level_ - 1));
    const vec3 flux = points_.flux[light] / points_.flux_scale;
    const float largest = std::max(flux.x, std::max(flux.y, flux.z));
    int found = 0;
    for (int corner = 0; corner < corners; ++corner) {
        const float given = place.weight(corner) * largest;
        found |= static_cast<int>(points_.s1 ? given > 0 : FixedPoint::term(given) > 0) << corner;
    }
    return found;
}

void VertexLayers::mark(int cell_layer) {
    if (cell_layer < 0) {
        clear(at(0));
        return;
    }
    clear(at(cell_layer + 1));
    const int shift = cell_shift(grid_, level_);
    const std::uint64_t inside = (std::uint64_t{1} << shift) - 1;
    // The weight of the farthest corner is at least the product of the distances to the nearest faces, which the keys
    // know. Where that times the flux of a light that is not dim is well above what rounding takes away, all corners
    // are touched.
    const std::uint64_t safe = std::uint64_t{1} << (3 * shift - 20);
    const auto [begin, end] = points_.keys.range(grid_, level_, cell_layer);
    Layer &near = at(cell_layer), &far = at(cell_layer + 1);
    int first_row = cells_ + 1, last_row = 0;
    std::uint64_t full = ~std::uint64_t{0};  // x and y of the last cell whose corners are all touched
    for (std::uint32_t i = begin; i < end; ++i) {
        const CellKey key = points_.keys.key[i];
        const int x = key.cell(0, shift), y = key.cell(1, shift);
        const std::uint64_t cell = static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x);
        if (cell == full) continue;
        std::uint64_t least = 1;
        for (int axis = 0; axis < 3; ++axis) {
            const std::uint64_t fraction = key.coordinate(axis) & inside;
            least *= fraction ^ (-(fraction >> (shift - 1)) & inside);
        }
        const bool sure = least > safe && !key.dim() && points_.vertex.empty();
        const std::uint64_t found = sure ? 0xff : static_cast<std::uint64_t>(exact_corners(i));
        if (found == 0xff)
            full = cell;
        else
            untouched_ += corners - std::popcount(found);
        const std::size_t row = static_cast<std::size_t>(y) * words_ * 8;
        // Two neighbours at once, wherever they lie: words as bytes, lowest first, as on all processors we build for.
        const auto set = [&](Layer& layer, std::size_t start, std::uint64_t two) {
            unsigned char* byte = reinterpret_cast<unsigned char*>(layer.bits.data()) + start + x / 8;
            std::uint16_t bits;
            std::memcpy(&bits, byte, 2);
            bits = static_cast<std::uint16_t>(bits | two << x % 8);
            std::memcpy(byte, &bits, 2);
        };
        set(near, row, found & 3);
        set(near, row + words_ * 8, found >> 2 & 3);
        set(far, row, found >> 4 & 3);
        set(far, row + words_ * 8, found >> 6);
        first_row = std::min(first_row, y);
        last_row = std::max(last_row, y + 2);
    }
    for (Layer* layer : {&near, &far}) {
        layer->first_row = std::min(layer->first_row, first_row);
        layer->last_row = std::max(layer->last_row, last_row);
    }
}

void VertexLayers::open(int z) {
    if (marked_ != z - 1) mark(z - 1);
    mark(z);
    marked_ = z;
    Layer& layer = at(z);
    std::uint32_t sum = 0;
    const auto words = static_cast<std::size_t>(words_);
    for (std::size_t w = layer.first_row * words; w < layer.last_row * words; ++w) {
        layer.before[w] = sum;
        sum += static_cast<std::uint32_t>(std::popcount(layer.bits[w]));
    }
    layer.count = sum;
}

VertexCount count_vertices(const KeyedPoints& points, const Grid& grid, int level, std::size_t most) {
    const std::vector<int> cuts = cut_layers(points.keys, grid, level);
    VertexCount count;
    count.of_layer.resize(grid.cells(level) + 1);
    std::atomic<std::size_t> total = 0, untouched = 0;
#pragma omp parallel
    {
        VertexLayers layers(points, grid, level);
#pragma omp for schedule(dynamic, 1)
        for (std::size_t task = 1; task < cuts.size(); ++task)
            for (int z = cuts[task - 1]; z < cuts[task] && total < most; ++z) {
                layers.open(z);
                count.of_layer[z] = layers.count(z);
                total += layers.count(z);
            }
        untouched += layers.untouched();
    }
    count.total = total;
    count.bound = total + untouched;
    return count;
}

}  // namespace lab
