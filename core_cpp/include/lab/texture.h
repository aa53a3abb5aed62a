// Textures: 8-bit sRGB with alpha, repeated, bilinear within a level and linear between mip levels.
#pragma once

#include <hwy/cache_control.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "lab/buffer.h"
#include "lab/select.h"
#include "lab/simd.h"

namespace lab {

// A colour in linear light, so that nobody who looks at it has to decode sRGB. Each channel plus `texel_bias` is a
// float in [2^-15, 2): all of these begin with the same five bits, and of the rest the first 21 are kept (`texel_bits`,
// relative error 2^-18). Red stands at its place in the lower word and green in the upper; what they leave free holds
// blue, turned round: its last 11 bits and its first 10.
using Texel = std::uint64_t;
constexpr float texel_bias = 0x1p-15f;
constexpr std::uint32_t texel_base = 0x38000000u, texel_bits = 0x07ffffc0u;
constexpr std::uint32_t blue_low = 0x0001ffc0u, blue_high = 0x07fe0000u;
constexpr int blue_low_turn = 11, blue_high_turn = 22;

LAB_INLINE float texel_channel(std::uint32_t bits) {
    return std::bit_cast<float>((bits & texel_bits) | texel_base) - texel_bias;
}

LAB_INLINE glm::vec3 linear_colour(Texel texel) {
    const auto low = static_cast<std::uint32_t>(texel), high = static_cast<std::uint32_t>(texel >> 32);
    const std::uint32_t blue =
        (std::rotl(low, blue_low_turn) & blue_low) | (std::rotl(high, blue_high_turn) & blue_high);
    return {texel_channel(low), texel_channel(high), texel_channel(blue)};
}

// The four texels around a point, and where it lies between them: the first, its right neighbour, and both of the next
// row. Images keep a column and a row more than they show, of what comes next where they repeat.
struct TexelSquare {
    std::size_t first;
    float fx, fy;
};

LAB_INLINE float texel_place(float t, int size, int& low) {
    // Wrap first: a huge or broken coordinate must not overflow the conversion to int.
    const float fraction = t - std::floor(t);
    const float wrapped = fraction < 1.0f ? fraction : 0.0f;
    const float x = wrapped * static_cast<float>(size) - 0.5f;
    const float whole = std::floor(x);
    const int texel = static_cast<int>(whole);
    low = texel < 0 ? texel + size : texel;
    return x - whole;
}

LAB_INLINE TexelSquare texel_square(int width, int height, const glm::vec2& uv) {
    int x, y;
    TexelSquare f;
    f.fx = texel_place(uv.x, width, x);
    f.fy = texel_place(uv.y, height, y);
    f.first = static_cast<std::size_t>(y) * (width + 1) + x;
    return f;
}

// One level of detail: rows of width + 1 texels, height + 1 of them, from number `first` of all texels on.
struct Mip {
    std::uint32_t first;
    std::int32_t width, height, unused;

    // Linear RGB at uv (v down).
    LAB_INLINE glm::vec3 sample(const Texel* texels, const glm::vec2& uv) const {
        const TexelSquare f = texel_square(width, height, uv);
        const float high = f.fx * f.fy, weight[4] = {1 - f.fx - f.fy + high, f.fx - high, f.fy - high, high};
        const Texel *upper = texels + first + f.first, *lower = upper + width + 1;
        glm::vec3 sum = weight[0] * linear_colour(upper[0]);
        sum += weight[1] * linear_colour(upper[1]);
        sum += weight[2] * linear_colour(lower[0]);
        sum += weight[3] * linear_colour(lower[1]);
        return sum;
    }
    // Brings near what sample() reads.
    LAB_INLINE void prefetch(const Texel* texels, const glm::vec2& uv) const {
        const Texel* upper = texels + first + texel_square(width, height, uv).first;
        hwy::Prefetch(upper);
        hwy::Prefetch(upper + width + 1);
    }
};

class Texture {
  public:
    // Puts its texels behind those that are there. Throws std::length_error where that are too many.
    Texture(int width, int height, std::span<const std::uint8_t> rgba, Buffer<Texel>& texels);

    float alpha(const glm::vec2& uv) const;  // of the full image
    int width() const { return mips_[0].width; }
    int height() const { return mips_[0].height; }
    const std::vector<Mip>& mips() const { return mips_; }

  private:
    std::vector<Mip> mips_;
    std::vector<std::uint8_t> alpha_;  // of the full image, by itself; empty where it is 1 everywhere
};

}  // namespace lab
