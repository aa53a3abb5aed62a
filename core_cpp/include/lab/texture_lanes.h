// Textures at sixteen points at once. Part of a Highway region: included once for each instruction set.
#if defined(LAB_TEXTURE_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LAB_TEXTURE_LANES_H
#undef LAB_TEXTURE_LANES_H
#else
#define LAB_TEXTURE_LANES_H
#endif

#include <hwy/cache_control.h>

#include <bit>
#include <cstring>

#include "lab/scene.h"
#include "lab/side_by_side.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

constexpr int texture_lanes = 16;

// linear_of_srgb by arithmetic, within 2e-6: gathers from a table take several times as long.
HWY_INLINE float linear_lane(std::uint32_t srgb) {
    constexpr float unit = 1 / 255.0f;
    const float s = static_cast<float>(static_cast<std::int32_t>(srgb)) * unit;
    float power = -0.272159040f + 0.0607455224f * s;  // ((s + 0.055) / 1.055)^2.4
    power = 0.535986423f + power * s;
    power = -0.656709254f + power * s;
    power = 0.801776648f + power * s;
    power = 0.494895130f + power * s;
    power = 0.0345933698f + power * s;
    power = 0.000872814388f + power * s;
    return s <= 0.04045f ? s * (1 / 12.92f) : power;
}

// The eight texels around each point, four of each of two levels: where the rows of each square begin, and their
// weights.
struct TexelLanes {
    const std::uint8_t *upper[2][texture_lanes], *lower[2][texture_lanes];
    float weight[8][texture_lanes];
    bool none;  // no point lies on a texture
};

// Where the squares of one level lie, and the weights within, times `share`.
HWY_INLINE void place_squares(const float (&mip)[4][texture_lanes], const float* u, const float* v, const float* share,
                              std::uint32_t* first, float (*weight)[texture_lanes]) {
#pragma omp simd
    for (int i = 0; i < texture_lanes; ++i) {
        const auto width = std::bit_cast<std::int32_t>(mip[2][i]), height = std::bit_cast<std::int32_t>(mip[3][i]);
        int x, y;
        const float fx = texel_place(u[i], width, x), fy = texel_place(v[i], height, y), part = share[i];
        first[i] = static_cast<std::uint32_t>(y * (width + 1) + x);
        const float right = fx * part, both = right * fy, below = part * fy;
        weight[0][i] = part - right - below + both;
        weight[1][i] = right - both;
        weight[2][i] = below - both;
        weight[3][i] = both;
    }
}

// And in memory, which is asked for at once: textures are too large for the caches.
HWY_INLINE void find_squares(const Mip* mips, const std::uint32_t* mip, const std::uint32_t* first,
                             const std::uint8_t** upper, const std::uint8_t** lower) {
    for (int i = 0; i < texture_lanes; ++i) {
        const Mip& m = mips[mip[i]];
        upper[i] = m.rgba + 4 * static_cast<std::size_t>(first[i]);
        lower[i] = upper[i] + 4 * (static_cast<std::size_t>(m.width) + 1);
        hwy::Prefetch(upper[i]);
        hwy::Prefetch(lower[i]);
    }
}

// What multiply_textures() will read for textures[number[i]] at (u, v)[i], at `level` + log2 of the texture's edge.
HWY_INLINE void find_texels(const Scene& scene, const float* number, const float* u, const float* v, const float* level,
                            TexelLanes& t) {
    std::uint32_t which[texture_lanes], fine[texture_lanes], coarse[texture_lanes], first[texture_lanes];
    float row[4][texture_lanes], near[texture_lanes], far[texture_lanes];
    std::int32_t any = -1;
#pragma omp simd reduction(& : any)
    for (int i = 0; i < texture_lanes; ++i) {
        const auto n = std::bit_cast<std::int32_t>(number[i]);
        any &= n;
        which[i] = static_cast<std::uint32_t>(n < 0 ? 0 : n);
    }
    t.none = any < 0 && scene.textures().empty();
    if (t.none) return;
    side_by_side<1>(scene.textures().data(), which, texture_lanes, row);
#pragma omp simd
    for (int i = 0; i < texture_lanes; ++i) {
        const float wanted = level[i] + row[2][i], last = row[1][i];
        const float l = wanted > 0 ? smaller(wanted, last) : 0.0f;  // NaN falls to 0
        const auto low = static_cast<std::int32_t>(l);
        const auto begin = std::bit_cast<std::int32_t>(row[0][i]), end = begin + static_cast<std::int32_t>(last);
        const std::int32_t at = begin + low;
        fine[i] = static_cast<std::uint32_t>(at);
        coarse[i] = static_cast<std::uint32_t>(at < end ? at + 1 : at);
        far[i] = l - static_cast<float>(low);
        near[i] = 1 - far[i];
    }
    const Mip* mips = scene.mips().data();
    side_by_side<1>(mips, fine, texture_lanes, row);
    place_squares(row, u, v, near, first, t.weight);
    find_squares(mips, fine, first, t.upper[0], t.lower[0]);
    side_by_side<1>(mips, coarse, texture_lanes, row);
    place_squares(row, u, v, far, first, t.weight + 4);
    find_squares(mips, coarse, first, t.upper[1], t.lower[1]);
}

// Multiplies `colour` by what the textures show there, as Texture::sample() does; where number[i] < 0 the colour stays.
HWY_INLINE void multiply_textures(const float* number, const TexelLanes& t, float (*colour)[texture_lanes]) {
    if (t.none) return;
    std::uint32_t texel[8][texture_lanes];
    for (int level = 0; level < 2; ++level)
        for (int i = 0; i < texture_lanes; ++i) {
            std::memcpy(&texel[4 * level][i], t.upper[level][i], 4);
            std::memcpy(&texel[4 * level + 1][i], t.upper[level][i] + 4, 4);
            std::memcpy(&texel[4 * level + 2][i], t.lower[level][i], 4);
            std::memcpy(&texel[4 * level + 3][i], t.lower[level][i] + 4, 4);
        }
    for (int c = 0; c < 3; ++c) {
#pragma omp simd
        for (int i = 0; i < texture_lanes; ++i) {
            float sum = 0;
            for (int k = 0; k < 8; ++k) sum += t.weight[k][i] * linear_lane(texel[k][i] >> (8 * c) & 255u);
            colour[c][i] *= std::bit_cast<std::int32_t>(number[i]) < 0 ? 1.0f : sum;
        }
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#endif
