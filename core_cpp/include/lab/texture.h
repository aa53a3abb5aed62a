// Textures: 8-bit sRGB with alpha, repeated, bilinear within a level and linear between mip levels.
#pragma once

#include <hwy/cache_control.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "lab/buffer.h"
#include "lab/select.h"
#include "lab/simd.h"

namespace lab {

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

extern const std::array<float, 256> linear_of_srgb;

// One level of detail: rows of width + 1 texels, height + 1 of them.
struct Mip {
    const std::uint8_t* rgba;
    std::int32_t width, height;
};
static_assert(sizeof(Mip) == 16, "side_by_side.h takes rows of 16 bytes");

class Texture {
  public:
    Texture(int width, int height, std::span<const std::uint8_t> rgba);
    Texture(Texture&&) = default;
    Texture& operator=(Texture&&) = default;

    // Linear RGB at uv (v down); level 0 is the full image, fractions blend two mip levels.
    LAB_INLINE glm::vec3 sample(const glm::vec2& uv, float level) const {
        const float last = static_cast<float>(mips_.size() - 1);
        const float l = level > 0 ? smaller(level, last) : 0.0f;  // NaN falls to 0
        const auto low = static_cast<std::uint32_t>(l);
        const glm::vec3 fine = bilinear(mips_[low], uv);
        const float fraction = l - static_cast<float>(low);
        if (!(fraction > 0)) return fine;
        return fine + fraction * (bilinear(mips_[low + 1], uv) - fine);
    }
    // What sample(uv, 0) reads.
    LAB_INLINE void prefetch(const glm::vec2& uv) const {
        const Mip& mip = mips_[0];
        const std::uint8_t* upper = mip.rgba + 4 * texel_square(mip.width, mip.height, uv).first;
        hwy::Prefetch(upper);
        hwy::Prefetch(upper + 4 * (static_cast<std::size_t>(mip.width) + 1));
    }
    float alpha(const glm::vec2& uv) const;  // of the full image
    float log2_texels() const { return log2_texels_; }
    int width() const { return mips_[0].width; }
    int height() const { return mips_[0].height; }
    const std::vector<Mip>& mips() const { return mips_; }

  private:
    std::vector<Mip> mips_;
    Buffer<std::uint8_t> texels_;      // of all levels
    std::vector<std::uint8_t> alpha_;  // of the full image, by itself; empty where it is 1 everywhere
    float log2_texels_;

    static LAB_INLINE glm::vec3 bilinear(const Mip& mip, const glm::vec2& uv) {
        const TexelSquare f = texel_square(mip.width, mip.height, uv);
        const float high = f.fx * f.fy, weight[4] = {1 - f.fx - f.fy + high, f.fx - high, f.fy - high, high};
        const std::uint8_t* upper = mip.rgba + 4 * f.first;
        const std::uint8_t* lower = upper + 4 * (static_cast<std::size_t>(mip.width) + 1);
        const std::uint8_t* const texel[4] = {upper, upper + 4, lower, lower + 4};
        glm::vec3 sum(0.0f);
        for (int k = 0; k < 4; ++k) {
            const std::uint8_t* p = texel[k];
            sum += weight[k] * glm::vec3(linear_of_srgb[p[0]], linear_of_srgb[p[1]], linear_of_srgb[p[2]]);
        }
        return sum;
    }
};

}  // namespace lab
