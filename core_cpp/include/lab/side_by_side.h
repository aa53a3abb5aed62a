// Rows of numbers that lie anywhere, brought side by side for SIMD. Part of a Highway region: included once for each
// instruction set.
#if defined(LAB_SIDE_BY_SIDE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_SIDE_BY_SIDE_H
#undef LAB_SIDE_BY_SIDE_H
#else
#define LAB_SIDE_BY_SIDE_H
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {

// Four numbers of as many rows as vectors of D have lanes.
template <class D>
struct FourColumns {
    hwy::HWY_NAMESPACE::Vec<D> at[4];
};

// Rows i, i + 4, i + 8 .. in the 16-byte blocks of a vector.
template <class D, class RowAt>
HWY_INLINE hwy::HWY_NAMESPACE::Vec<D> blocks_of_rows(D d, const RowAt& row, int i) {
    namespace hn = hwy::HWY_NAMESPACE;
    if constexpr (hn::MaxLanes(D()) == 4) {
        return hn::LoadU(d, row(i));
    } else {
        const hn::Half<D> half;
        constexpr int rows = hn::MaxLanes(D()) / 2;
        return hn::Combine(d, blocks_of_rows(half, row, i + rows), blocks_of_rows(half, row, i));
    }
}

// Those that lie at row(i). Squares of 4 x 4 numbers transposed. A wide gather fetches every number by itself, this a
// quarter of a row at once.
template <class D, class RowAt>
HWY_INLINE FourColumns<D> four_columns(D d, const RowAt& row) {
    namespace hn = hwy::HWY_NAMESPACE;
    const auto a = blocks_of_rows(d, row, 0), b = blocks_of_rows(d, row, 1);
    const auto c = blocks_of_rows(d, row, 2), e = blocks_of_rows(d, row, 3);
    const auto low_ac = hn::InterleaveLower(d, a, c), low_be = hn::InterleaveLower(d, b, e);
    const auto high_ac = hn::InterleaveUpper(d, a, c), high_be = hn::InterleaveUpper(d, b, e);
    return {{hn::InterleaveLower(d, low_ac, low_be), hn::InterleaveUpper(d, low_ac, low_be),
             hn::InterleaveLower(d, high_ac, high_be), hn::InterleaveUpper(d, high_ac, high_be)}};
}

// The first 4 * quads columns of rows[index[i]], i < count (a multiple of 4).
template <int quads, class Row, std::size_t capacity>
HWY_INLINE void side_by_side(const Row* rows, const std::uint32_t* index, int count, float (*columns)[capacity]) {
    namespace hn = hwy::HWY_NAMESPACE;
    static_assert(sizeof(Row) % 16 == 0 && sizeof(Row) >= quads * 16);
    const auto bring = [=](auto d, int i) HWY_ATTR {
        for (int q = 0; q < quads; ++q) {
            const auto found = four_columns(
                d, [=](int j) HWY_ATTR { return reinterpret_cast<const float*>(rows + index[i + j]) + 4 * q; });
            for (int c = 0; c < 4; ++c) hn::StoreU(found.at[c], d, columns[4 * q + c] + i);
        }
    };
    const hn::CappedTag<float, 16> wide;
    constexpr int lanes = hn::MaxLanes(wide);
    int i = 0;
    for (; i + lanes <= count; i += lanes) bring(wide, i);
    if constexpr (lanes > 4)
        for (; i < count; i += 4) bring(hn::Full128<float>(), i);
}

}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
