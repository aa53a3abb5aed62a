// How a pass of the a-trous filters is shared out, and what it keeps from line to line.
#pragma once

#include <algorithm>
#include <array>
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

// A number for each of the 12 pairs of each pixel, of the last three lines.
class PairRows {
  public:
    explicit PairRows(int width) : planes_(width, 3, static_cast<int>(pair_offsets.size())) {}

    // Pixel x0 of the strip is at [0].
    float* row(int j, int pair) { return planes_.row(pair, (j + 3) % 3); }

  private:
    Planes planes_;
};

// Calls work(strip, pair rows of this thread) for all strips of a pass, in parallel.
template <class Work>
void for_strips(const Planes& planes, int step, const Work& work) {
    const std::vector<Strip> all = strips(planes.width(), planes.height(), step);
    int widest = 0;
    for (const Strip& strip : all) widest = std::max(widest, strip.x1 - strip.x0);
#pragma omp parallel if (planes.worth_threads())
    {
        PairRows pairs(widest);
#pragma omp for schedule(dynamic)
        for (std::size_t i = 0; i < all.size(); ++i) work(all[i], pairs);
    }
}

}  // namespace lab
