// The weights of all pairs of pixels of a line with later ones, and how a window reads them from both ends. In vectors
// of pixels; compiled for each instruction set.
#if defined(LAB_FILTER_PAIRS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_FILTER_PAIRS_H
#undef LAB_FILTER_PAIRS_H
#else
#define LAB_FILTER_PAIRS_H
#endif

#include <array>
#include <type_traits>

#include "lab/filter_strip.h"
#include "lab/filter_weights.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {

// Lines are filtered in blocks where registers suffice: what one reads of a pixel, the next one reads, too.
inline constexpr int block_lines = HWY_TARGET == HWY_AVX3 ? 2 : 1;

// The rows that a window reads are too many for the processor to foresee: they are asked for so many columns ahead.
inline constexpr int ahead = 32;

// Calls f(std::integral_constant<int, i>()) for all i of [first, last).
template <int first, int last, class F>
HWY_INLINE void unrolled(const F& f) {
    if constexpr (first < last) {
        f(std::integral_constant<int, first>());
        unrolled<first + 1, last>(f);
    }
}

// The pairs of columns [x, last) and lines j.. of a block with pixels in later lines from `from` on, counted in the
// block, and columns `left` to `right` steps away.
template <int lines, int radius, int from, int left, int right, class Guide, class Weigh>
HWY_INLINE void fill_columns(const Strip& strip, int j, int x, int last,
                             const std::array<typename Guide::Row, lines + 2>& rows, PairRows& pairs,
                             const Weigh& weigh) {
    const Lanes f32;
    std::array<float*, lines> stored;
    for (int i = 0; i < lines; ++i) stored[i] = pairs.row(j + i, 0) - strip.x0;
    for (; x < last; x += static_cast<int>(hn::Lanes(f32))) {
        std::array<Guide, lines> p;
        for (int i = 0; i < lines; ++i) p[i] = Guide(rows[i], x);
        for (int i = 0; i < lines + radius; ++i) rows[i].prefetch(x + right * strip.step + ahead);
        unrolled<from, lines + radius>([&](auto row) LAB_INLINE {
            unrolled<left, right + 1>([&](auto dx) LAB_INLINE {
                if constexpr (row > 0 || dx > 0) {
                    const Guide q(rows[row], x + dx * strip.step);
                    unrolled<0, lines>([&](auto i) LAB_INLINE {
                        constexpr int dy = row - i;
                        if constexpr (dy <= radius && (dy > 0 || (dy == 0 && dx > 0))) {
                            constexpr float space = per_squared_offset * static_cast<float>(dx * dx + dy * dy);
                            hn::StoreU(weigh(p[i], q, space), f32,
                                       stored[i] + pair_index(dy, dx) * PairRows::stride + x);
                        }
                    });
                }
            });
        });
    }
}

// All pairs of a block's lines up to `radius` steps apart, with pixels in lines from `from` on.
// Guide: a pixel's guides, constructed from a Guide::Row and a column. row_of(y): the row of the image's line y.
template <int lines, int radius, int from, class Guide, class RowOf, class Weigh>
HWY_INLINE void fill_pairs(const Strip& strip, int j, PairRows& pairs, const RowOf& row_of, const Weigh& weigh) {
    const int reach = radius * strip.step;
    std::array<typename Guide::Row, lines + 2> rows;
    for (int i = 0; i < lines + radius; ++i) rows[i] = row_of(strip.row(j + i));
    // Pixels beside the strip matter as the other end of its own.
    fill_columns<lines, radius, from, 1, radius, Guide>(strip, j, strip.x0 - reach, strip.x0, rows, pairs, weigh);
    fill_columns<lines, radius, from, -radius, radius, Guide>(strip, j, strip.x0, strip.x1, rows, pairs, weigh);
    fill_columns<lines, radius, from, -radius, -1, Guide>(strip, j, strip.x1, strip.x1 + reach, rows, pairs, weigh);
}

// Calls mix(j, std::integral_constant<int, lines>()) for all lines of a strip, block by block, with the pairs at hand
// that windows of `radius` steps around them read.
template <int radius, class Guide, class RowOf, class Weigh, class Mix>
HWY_INLINE void for_blocks(const Strip& strip, PairRows& pairs, const RowOf& row_of, const Weigh& weigh,
                           const Mix& mix) {
    // Of the two lines before the strip only the pairs that reach into it.
    fill_pairs<2, radius, 2, Guide>(strip, strip.first - 2, pairs, row_of, weigh);
    int j = strip.first;
    for (; j + block_lines <= strip.last; j += block_lines) {
        fill_pairs<block_lines, radius, 0, Guide>(strip, j, pairs, row_of, weigh);
        mix(j, std::integral_constant<int, block_lines>());
    }
    for (; j < strip.last; ++j) {
        fill_pairs<1, radius, 0, Guide>(strip, j, pairs, row_of, weigh);
        mix(j, std::integral_constant<int, 1>());
    }
}

// What the windows around a block's lines, j and the next, read for the strip's first pixel: pairs, and `count` planes
// from `first` on.
template <int lines, int radius>
class Windows {
  public:
    Windows(const Strip& strip, int j, PairRows& pairs, const Planes& planes, int first, int count)
        : stride_(planes.stride()), count_(count) {
        int both = 0, upper = 0, lower = 0;
        for (int row = -radius; row < lines + radius; ++row) {
            const float* line = planes.row(first, strip.row(j + row)) + strip.x0;
            ends_[row + radius] = line + radius * strip.step + ahead;
            for (int dx = -radius; dx <= radius; ++dx) {
                const auto pair = [&](int i) -> const float* {
                    const int dy = row - i;
                    if (dy < -radius || dy > radius || (dy == 0 && dx == 0)) return nullptr;
                    const bool later = dy > 0 || (dy == 0 && dx > 0);
                    return later ? pairs.row(j + i, pair_index(dy, dx))
                                 : pairs.row(j + row, pair_index(-dy, -dx)) + dx * strip.step;
                };
                const float* q = line + dx * strip.step;
                const float *of_first = pair(0), *of_second = lines > 1 ? pair(1) : nullptr;
                if (of_first && of_second)
                    both_[both++] = {q, of_first, of_second};
                else if (of_first)
                    upper_[upper++] = {q, of_first};
                else if (of_second)
                    lower_[lower++] = {q, of_second};
            }
        }
    }

    void prefetch(int x) const {
        for (const float* end : ends_)
            for (int plane = 0; plane < count_; ++plane) hwy::Prefetch(end + plane * stride_ + x);
    }

    // Calls look(q, each) for the pixels q of the windows around column x. In it each(weigh) calls weigh(i, the pair's
    // number) for the lines i of the block whose window has q in it.
    template <class Look>
    HWY_INLINE void visit(int x, const Look& look) const {
        using Upper = std::integral_constant<int, 0>;
        using Lower = std::integral_constant<int, 1>;
        const Lanes f32;
        for (int tap = 0; tap < alone; ++tap) {
            look(upper_[tap].q + x,
                 [&](const auto& weigh) LAB_INLINE { weigh(Upper(), hn::LoadU(f32, upper_[tap].pair + x)); });
            if constexpr (lines > 1)
                look(lower_[tap].q + x,
                     [&](const auto& weigh) LAB_INLINE { weigh(Lower(), hn::LoadU(f32, lower_[tap].pair + x)); });
        }
        for (const Shared& tap : both_)
            look(tap.q + x, [&](const auto& weigh) LAB_INLINE {
                weigh(Upper(), hn::LoadU(f32, tap.upper + x));
                if constexpr (lines > 1) weigh(Lower(), hn::LoadU(f32, tap.lower + x));
            });
    }

  private:
    struct Tap {
        const float *q, *pair;
    };
    struct Shared {
        const float *q, *upper, *lower;
    };
    static constexpr int side = 2 * radius + 1, taps = side * side - 1;
    static constexpr int alone = lines > 1 ? side + 1 : taps;
    const std::size_t stride_;
    const int count_;
    std::array<const float*, lines + 2 * radius> ends_;
    std::array<Shared, taps - alone> both_;
    std::array<Tap, alone> upper_, lower_;
};

}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
