// Textures at sixteen points at once. Part of a Highway region: included once for each instruction set.
#if defined(LAB_TEXTURE_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_TEXTURE_LANES_H
#undef LAB_TEXTURE_LANES_H
#else
#define LAB_TEXTURE_LANES_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <bit>

#include "lab/scene.h"
#include "lab/side_by_side.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

constexpr int texture_lanes = 16;

// The eight texels around each point, four of each of two levels: the first of each pair, and their weights.
struct alignas(64) TexelLanes {
    std::uint32_t pair[4][texture_lanes];  // fine level: upper row, lower row; the same of the coarse one
    float weight[8][texture_lanes];
    std::int32_t levels[texture_lanes];
    int used;  // levels: 0 where no point lies on a texture, 1 where each lies on its finest
};

// Where the squares of one level lie, and the weights within, times `share`.
HWY_INLINE void place_squares(const float (*mip)[texture_lanes], const float* u, const float* v, const float* share,
                              std::uint32_t (*pair)[texture_lanes], float (*weight)[texture_lanes]) {
#pragma omp simd
    for (int i = 0; i < texture_lanes; ++i) {
        const auto width = std::bit_cast<std::int32_t>(mip[1][i]), height = std::bit_cast<std::int32_t>(mip[2][i]);
        int x, y;
        const float fx = texel_place(u[i], width, x), fy = texel_place(v[i], height, y), part = share[i];
        const std::uint32_t upper =
            std::bit_cast<std::uint32_t>(mip[0][i]) + static_cast<std::uint32_t>(y * (width + 1) + x);
        pair[0][i] = upper;
        pair[1][i] = upper + static_cast<std::uint32_t>(width + 1);
        const float right = fx * part, both = right * fy, below = part * fy;
        weight[0][i] = part - right - below + both;
        weight[1][i] = right - both;
        weight[2][i] = below - both;
        weight[3][i] = both;
    }
}

// What multiply_textures() will read at (u, v)[i] of the textures whose levels are TriangleRow::levels, at `level`. It
// is asked for at once: textures are too large for the caches.
HWY_INLINE void find_texels(const Scene& scene, const float* levels, const float* u, const float* v, const float* level,
                            TexelLanes& t) {
    namespace hn = hwy::HWY_NAMESPACE;
    std::uint32_t mip[texture_lanes];
    float row[8][texture_lanes], near[texture_lanes], far[texture_lanes];
    std::int32_t all = -1, beyond = 0;
#pragma omp simd reduction(& : all) reduction(| : beyond)
    for (int i = 0; i < texture_lanes; ++i) {
        const auto word = std::bit_cast<std::int32_t>(levels[i]);
        t.levels[i] = word;
        all &= word;
        const std::int32_t there = word < 0 ? 0 : word;
        const auto last = static_cast<float>(there >> TriangleRow::rows);
        const float l = level[i] > 0 ? smaller(level[i], last) : 0.0f;  // NaN falls to 0
        const auto low = static_cast<std::int32_t>(l);
        mip[i] = static_cast<std::uint32_t>((there & TriangleRow::row_bits) + low);
        far[i] = l - static_cast<float>(low);
        near[i] = 1 - far[i];
        beyond |= far[i] > 0 ? 1 : 0;
    }
    t.used = all < 0 ? 0 : beyond != 0 ? 2 : 1;
    if (t.used == 0) return;
    const hn::CappedTag<float, texture_lanes> d;
    for (int k = 0; k < t.used; ++k)
        for (std::size_t i = 0; i < texture_lanes; i += hn::Lanes(d)) {
            const Mip* mips = scene.mips().data() + k;
            const auto found =
                four_columns(d, [&](int j) HWY_ATTR { return reinterpret_cast<const float*>(mips + mip[i + j]); });
            for (int c = 0; c < 3; ++c) hn::StoreU(found.at[c], d, row[4 * k + c] + i);
        }
    const Texel* texels = scene.data().texels.data();
    for (int k = 0; k < t.used; ++k) {
        place_squares(row + 4 * k, u, v, k == 0 ? near : far, t.pair + 2 * k, t.weight + 4 * k);
        for (int i = 0; i < texture_lanes; ++i) {
            hwy::Prefetch(texels + t.pair[2 * k][i]);
            hwy::Prefetch(texels + t.pair[2 * k + 1][i]);
        }
    }
}

// The three channels of texels in linear light (texture.h), from their lower and upper words.
template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE void linear_lanes(D d, V low_word, V high_word, V (&colour)[3]) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::RebindToUnsigned<D> du;
    const auto low = hn::BitCast(du, low_word), high = hn::BitCast(du, high_word);
    const auto base = hn::Set(du, texel_base), bits = hn::Set(du, texel_bits);
    const auto last = hn::OrAnd(base, hn::Set(du, blue_low), hn::RotateRight<32 - blue_low_turn>(low));
    const auto blue = hn::OrAnd(last, hn::Set(du, blue_high), hn::RotateRight<32 - blue_high_turn>(high));
    const V bias = hn::Set(d, texel_bias);
    colour[0] = hn::Sub(hn::BitCast(d, hn::OrAnd(base, bits, low)), bias);
    colour[1] = hn::Sub(hn::BitCast(d, hn::OrAnd(base, bits, high)), bias);
    colour[2] = hn::Sub(hn::BitCast(d, blue), bias);
}

// Multiplies `colour` by what the textures show there; where a point lies on none the colour stays.
HWY_INLINE void multiply_textures(const Scene& scene, const TexelLanes& t, float (*colour)[texture_lanes]) {
    namespace hn = hwy::HWY_NAMESPACE;
    if (t.used == 0) return;
    const Texel* texels = scene.data().texels.data();
    const hn::CappedTag<float, texture_lanes> d;
    const hn::RebindToSigned<decltype(d)> di;
    using V = hn::Vec<decltype(d)>;
    for (std::size_t i = 0; i < texture_lanes; i += hn::Lanes(d)) {
        V sum[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        for (int p = 0; p < 2 * t.used; ++p) {
            const auto words = four_columns(
                d, [&](int j) HWY_ATTR { return reinterpret_cast<const float*>(texels + t.pair[p][i + j]); });
            V left[3], right[3];
            linear_lanes(d, words.at[0], words.at[1], left);
            linear_lanes(d, words.at[2], words.at[3], right);
            const V weight = hn::LoadU(d, t.weight[2 * p] + i), next = hn::LoadU(d, t.weight[2 * p + 1] + i);
            for (int c = 0; c < 3; ++c) sum[c] = hn::MulAdd(right[c], next, hn::MulAdd(left[c], weight, sum[c]));
        }
        const auto none = hn::RebindMask(d, hn::Lt(hn::LoadU(di, t.levels + i), hn::Zero(di)));
        for (int c = 0; c < 3; ++c) {
            const V shown = hn::IfThenElse(none, hn::Set(d, 1.0f), sum[c]);
            hn::StoreU(hn::Mul(hn::LoadU(d, colour[c] + i), shown), d, colour[c] + i);
        }
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
