// How a pass of the a-trous filters is shared out, and what it keeps from line to line.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "lab/filter_planes.h"

namespace lab {

inline constexpr std::array<int, 5> atrous_steps{1, 2, 4, 8, 16};

// What one thread filters in one go: columns [x0, x1) of the lines residue + step * j, first <= j < last. Lines a step
// apart are each other's taps: one after the other they stay in the cache, whatever the step.
struct Strip {
    int step, residue, first, last, x0, x1, height;

    // The image row of line j, reflected where j is outside.
    int row(int j) const { return reflected(residue + step * j, step, height); }
};

std::vector<Strip> strips(int width, int height, int step);

// A pair of pixels weighs the same from both ends, so 12 of the 24 taps of a 5 x 5 window make all: those to pixels
// that come later.
struct PairOffset {
    int dy, dx;
};
inline constexpr std::array<PairOffset, 12> pair_offsets{
    {{0, 1}, {0, 2}, {1, -2}, {1, -1}, {1, 0}, {1, 1}, {1, 2}, {2, -2}, {2, -1}, {2, 0}, {2, 1}, {2, 2}}};

// The place in pair_offsets of the tap (dy, dx) to a later pixel.
constexpr int pair_index(int dy, int dx) {
    return dy == 0 ? dx - 1 : 5 * dy - 1 + dx;
}

inline constexpr int widest_strip = 640;  // columns

// A number for each of the 12 pairs of each pixel, of the last four lines. Rows lie odd numbers of cache lines apart,
// as those of planes do.
class PairRows {
  public:
    // Floats from a pair's row to the next pair's.
    static constexpr std::size_t stride = widest_strip + 2 * Planes::border + Planes::slack;

    // Pixel x0 of the strip is at [0].
    float* row(int j, int pair) { return values_.data() + (j + 4) % 4 * line + pair * stride + Planes::border; }

  private:
    static constexpr std::size_t line = stride * pair_offsets.size() + 16;
    alignas(64) std::array<float, 4 * line> values_;
};

// Calls work(strip, pair rows of this thread) for all strips of a pass, in parallel.
template <class Work>
void for_strips(const Planes& planes, int step, const Work& work) {
    const std::vector<Strip> all = strips(planes.width(), planes.height(), step);
#pragma omp parallel if (planes.worth_threads())
    {
        const auto pairs = std::make_unique_for_overwrite<PairRows>();
#pragma omp for schedule(dynamic)
        for (std::size_t i = 0; i < all.size(); ++i) work(all[i], *pairs);
    }
}

}  // namespace lab
