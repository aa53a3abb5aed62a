#include "lab/cell_keys.h"

#include <omp.h>

#include <algorithm>

#include "lab/select.h"

namespace lab {
namespace {

constexpr std::size_t layers = std::size_t{1} << layer_bits;

// Sorts keys and points by `digit`, keeping the order of equals.
template <class Digit>
void counting_sort(std::span<const CellKey> key, std::span<const std::uint32_t> point, CellKey* to_key,
                   std::uint32_t* to_point, std::vector<std::uint32_t>& next, std::size_t digits, const Digit& digit) {
    next.assign(digits + 1, 0);
    for (const CellKey k : key) ++next[digit(k) + 1];
    for (std::size_t d = 1; d < digits; ++d) next[d] += next[d - 1];
    for (std::size_t i = 0; i < key.size(); ++i) {
        const std::uint32_t at = next[digit(key[i])]++;
        to_key[at] = key[i];
        to_point[at] = point[i];
    }
}

// Puts the points of each cell of a sorted layer into their given order: layers were cut finer than this one.
void order_ties(std::span<CellKey> key, std::span<std::uint32_t> point, int shift) {
    const std::uint64_t column = (((std::uint64_t{1} << key_bits) - 1) >> shift) << shift;
    const std::uint64_t cell = column | column << key_bits;  // of x and y
    constexpr std::size_t few = 64;
    std::vector<std::pair<std::uint32_t, CellKey>> both;
    for (std::size_t begin = 0, end = 0; begin < key.size(); begin = end) {
        const auto in_cell = [&](std::size_t i) { return ((key[i].bits ^ key[begin].bits) & cell) == 0; };
        for (end = begin + 1; end < key.size() && end - begin < few && in_cell(end); ++end) {
            const std::uint32_t p = point[end];
            const CellKey k = key[end];
            std::size_t at = end;
            for (; at > begin && point[at - 1] > p; --at) {
                point[at] = point[at - 1];
                key[at] = key[at - 1];
            }
            point[at] = p;
            key[at] = k;
        }
        if (end - begin < few) continue;
        while (end < key.size() && in_cell(end)) ++end;
        both.clear();
        for (std::size_t i = begin; i < end; ++i) both.emplace_back(point[i], key[i]);
        std::sort(both.begin(), both.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
        for (std::size_t i = begin; i < end; ++i) {
            point[i] = both[i - begin].first;
            key[i] = both[i - begin].second;
        }
    }
}

}  // namespace

CellKeys cell_keys(std::span<const glm::vec3> position, std::span<const glm::vec3> flux, float dim_below,
                   const Grid& grid) {
    const auto count = static_cast<std::int64_t>(position.size());
    // As Grid::locate for a level of 2^key_bits cells: scaling by a power of two is exact.
    const float inverse = 1.0f / grid.cell_size(grid.top) * static_cast<float>(1 << key_bits);
    const float last = static_cast<float>((1 << key_bits) - 1);
    constexpr int to_layer = key_bits - layer_bits;
    CellKeys keys;
    keys.key.resize(position.size());
    keys.point.resize(position.size());
    keys.layer.assign(layers + 1, 0);
    Buffer<CellKey> unsorted(position.size());
    std::vector<std::vector<std::uint32_t>> starts;  // per thread: where its points of each layer go
#pragma omp parallel
    {
#pragma omp single
        starts.resize(omp_get_num_threads());
        const int thread = omp_get_thread_num();
        const auto threads = static_cast<std::int64_t>(starts.size());
        const std::int64_t begin = count * thread / threads, end = count * (thread + 1) / threads;
        std::vector<std::uint32_t>& start = starts[thread];
        start.assign(layers, 0);
        for (std::int64_t i = begin; i < end; ++i) {
            const glm::vec3 u = (position[i] - grid.origin) * inverse;
            std::uint64_t bits = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const auto at = static_cast<std::int32_t>(smaller(larger(u[axis], 0.0f), last));
                bits |= static_cast<std::uint64_t>(at) << (axis * key_bits);
            }
            const glm::vec3& f = flux[i];
            bits |= static_cast<std::uint64_t>(larger(f.x, larger(f.y, f.z)) < dim_below) << 63;
            unsorted[i] = {bits};
            ++start[unsorted[i].coordinate(2) >> to_layer];
        }
#pragma omp barrier
#pragma omp single
        {
            std::uint32_t sum = 0;
            for (std::size_t layer = 0; layer < layers; ++layer) {
                keys.layer[layer] = sum;
                for (std::vector<std::uint32_t>& s : starts) sum += std::exchange(s[layer], sum);
            }
            keys.layer[layers] = sum;
        }
        for (std::int64_t i = begin; i < end; ++i) {
            const CellKey key = unsorted[i];
            const std::uint32_t at = start[key.coordinate(2) >> to_layer]++;
            keys.key[at] = key;
            keys.point[at] = static_cast<std::uint32_t>(i);
        }
    }
    return keys;
}

void sort_cells(CellKeys& keys, const Grid& grid, int level) {
    const int cells = grid.cells(level), shift = cell_shift(grid, level);
#pragma omp parallel
    {
        std::vector<CellKey> key;
        std::vector<std::uint32_t> point, next;
#pragma omp for schedule(dynamic, 1)
        for (int z = 0; z < cells; ++z) {
            const auto [begin, end] = keys.range(grid, level, z);
            const std::size_t count = end - begin;
            if (count < 2) continue;
            const std::span in_key(keys.key.data() + begin, count);
            const std::span in_point(keys.point.data() + begin, count);
            key.resize(count);
            point.resize(count);
            counting_sort(in_key, in_point, key.data(), point.data(), next, cells,
                          [shift](CellKey k) { return k.coordinate(0) >> shift; });
            counting_sort(key, point, in_key.data(), in_point.data(), next, cells,
                          [shift](CellKey k) { return k.coordinate(1) >> shift; });
            order_ties(in_key, in_point, shift);
        }
    }
}

std::vector<int> cut_layers(const CellKeys& keys, const Grid& grid, int level) {
    const int vertices = grid.cells(level) + 1;
    const std::int64_t tasks = std::min(vertices, 8 * omp_get_max_threads());
    const auto points = static_cast<std::int64_t>(keys.key.size());
    std::vector<int> cuts{0};
    for (int z = 1; z < vertices; ++z) {
        const auto next = static_cast<std::int64_t>(cuts.size());
        if (keys.range(grid, level, z - 1).second * tasks >= points * next) cuts.push_back(z);
    }
    cuts.push_back(vertices);
    return cuts;
}

}  // namespace lab
