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

// The first 4 * quads columns of rows[index[i]], i < count (a multiple of 4): four rows at a time, squares of 4 x 4
// numbers transposed. A wide gather fetches every number by itself, this a quarter of a row at once.
template <int quads, class Row, std::size_t capacity>
HWY_INLINE void side_by_side(const Row* rows, const std::uint32_t* index, int count, float (*columns)[capacity]) {
    namespace hn = hwy::HWY_NAMESPACE;
    static_assert(sizeof(Row) % 16 == 0 && sizeof(Row) >= quads * 16);
    const hn::Full128<float> d;
    for (int i = 0; i < count; i += 4) {
        const auto* a = reinterpret_cast<const float*>(rows + index[i]);
        const auto* b = reinterpret_cast<const float*>(rows + index[i + 1]);
        const auto* c = reinterpret_cast<const float*>(rows + index[i + 2]);
        const auto* e = reinterpret_cast<const float*>(rows + index[i + 3]);
        for (int q = 0; q < quads; ++q) {
            const auto va = hn::LoadU(d, a + 4 * q), vb = hn::LoadU(d, b + 4 * q);
            const auto vc = hn::LoadU(d, c + 4 * q), ve = hn::LoadU(d, e + 4 * q);
            const auto low_ac = hn::InterleaveLower(d, va, vc), low_be = hn::InterleaveLower(d, vb, ve);
            const auto high_ac = hn::InterleaveUpper(d, va, vc), high_be = hn::InterleaveUpper(d, vb, ve);
            hn::StoreU(hn::InterleaveLower(d, low_ac, low_be), d, columns[4 * q] + i);
            hn::StoreU(hn::InterleaveUpper(d, low_ac, low_be), d, columns[4 * q + 1] + i);
            hn::StoreU(hn::InterleaveLower(d, high_ac, high_be), d, columns[4 * q + 2] + i);
            hn::StoreU(hn::InterleaveUpper(d, high_ac, high_be), d, columns[4 * q + 3] + i);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
