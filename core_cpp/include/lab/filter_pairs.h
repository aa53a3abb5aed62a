// The weights of all pairs of pixels of a line with later ones, and how a window reads them from both ends. In vectors
// of pixels; compiled for each instruction set.
#if defined(LAB_FILTER_PAIRS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_FILTER_PAIRS_H
#undef LAB_FILTER_PAIRS_H
#else
#define LAB_FILTER_PAIRS_H
#endif

#include <array>

#include "lab/filter_strip.h"
#include "lab/filter_weights.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {

// The pairs of columns [x, last) of one line: stores weigh(p, q, offset) for the given ones of pair_offsets.
template <class Guide, class Weigh>
HWY_INLINE void fill_columns(const Strip& strip, int j, int x, int last, const int* chosen, int count,
                             const std::array<typename Guide::Row, 3>& rows, PairRows& pairs, const Weigh& weigh) {
    const Lanes f32;
    std::array<typename Guide::Row, pair_offsets.size()> taps;
    std::array<float*, pair_offsets.size()> stored;
    std::array<float, pair_offsets.size()> space;
    for (int i = 0; i < count; ++i) {
        const auto [dy, dx] = pair_offsets[chosen[i]];
        taps[i] = rows[dy].shifted(dx * strip.step);
        stored[i] = pairs.row(j, chosen[i]);
        space[i] = per_squared_offset * static_cast<float>(dx * dx + dy * dy);
    }
    for (; x < last; x += static_cast<int>(hn::Lanes(f32))) {
        const Guide p(rows[0], x);
        for (int i = 0; i < count; ++i)
            hn::StoreU(weigh(p, Guide(taps[i], x), space[i]), f32, stored[i] + (x - strip.x0));
    }
}

// All pairs of line j of a strip up to `radius` steps apart; for the lines before the strip those that reach into it.
// Guide: a pixel's guides, constructed from a Guide::Row and a column. row_of(y): the row of the image's line y.
template <class Guide, class RowOf, class Weigh>
HWY_INLINE void fill_pairs(const Strip& strip, int j, int radius, PairRows& pairs, const RowOf& row_of,
                           const Weigh& weigh) {
    const int least = strip.first - j, reach = radius * strip.step;
    std::array<int, pair_offsets.size()> all, to_right, to_left;
    int count = 0, right = 0, left = 0;
    for (int i = 0; i < static_cast<int>(pair_offsets.size()); ++i) {
        const auto [dy, dx] = pair_offsets[i];
        if (dy < least || dy > radius || dx < -radius || dx > radius) continue;
        all[count++] = i;
        if (dx > 0) to_right[right++] = i;
        if (dx < 0) to_left[left++] = i;
    }
    const std::array<typename Guide::Row, 3> rows{row_of(strip.row(j)), row_of(strip.row(j + 1)),
                                                  row_of(strip.row(j + 2))};
    // Pixels beside the strip matter as the other end of its own.
    fill_columns<Guide>(strip, j, strip.x0 - reach, strip.x0, to_right.data(), right, rows, pairs, weigh);
    fill_columns<Guide>(strip, j, strip.x0, strip.x1, all.data(), count, rows, pairs, weigh);
    fill_columns<Guide>(strip, j, strip.x1, strip.x1 + reach, to_left.data(), left, rows, pairs, weigh);
}

// What a tap reads for the strip's first pixel: the pair's number, and its q in the first of some planes.
struct Tap {
    const float *pair, *q;
};

// The (2 radius + 1)^2 - 1 taps of line j; all pairs from line j - radius on must be there. Returns their number.
HWY_INLINE int window(const Strip& strip, int j, int radius, PairRows& pairs, const Planes& planes,
                      std::array<Tap, 24>& taps) {
    int count = 0;
    for (int dy = -radius; dy <= radius; ++dy) {
        const float* line = planes.row(0, strip.row(j + dy)) + strip.x0;
        for (int dx = -radius; dx <= radius; ++dx) {
            if (dx == 0 && dy == 0) continue;
            const int shift = dx * strip.step;
            const bool later = dy > 0 || (dy == 0 && dx > 0);
            const float* pair =
                later ? pairs.row(j, pair_index(dy, dx)) : pairs.row(j + dy, pair_index(-dy, -dx)) + shift;
            taps[count++] = {pair, line + shift};
        }
    }
    return count;
}

}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
