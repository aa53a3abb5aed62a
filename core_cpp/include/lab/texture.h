// Textures: 8-bit sRGB with alpha, repeated, bilinear within a level and linear between mip levels.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "lab/select.h"
#include "lab/simd.h"

namespace lab {

// The four texels around a point and the weights between them.
struct TexelSquare {
    std::size_t texel[4];
    float fx, fy;
};

LAB_INLINE float texel_place(float t, int size, int& low, int& high) {
    // Wrap first: a huge or broken coordinate must not overflow the conversion to int.
    const float fraction = t - std::floor(t);
    const float wrapped = fraction < 1.0f ? fraction : 0.0f;
    const float x = wrapped * static_cast<float>(size) - 0.5f;
    const float whole = std::floor(x);
    const int texel = static_cast<int>(whole);
    low = texel < 0 ? texel + size : texel;
    high = low + 1 < size ? low + 1 : 0;
    return x - whole;
}

LAB_INLINE TexelSquare texel_square(int width, int height, const glm::vec2& uv) {
    int x0, x1, y0, y1;
    TexelSquare f;
    f.fx = texel_place(uv.x, width, x0, x1);
    f.fy = texel_place(uv.y, height, y0, y1);
    const std::size_t low = static_cast<std::size_t>(y0) * width, high = static_cast<std::size_t>(y1) * width;
    f.texel[0] = low + x0;
    f.texel[1] = low + x1;
    f.texel[2] = high + x0;
    f.texel[3] = high + x1;
    return f;
}

extern const std::array<float, 256> linear_of_srgb;

class Texture {
  public:
    Texture(int width, int height, std::span<const std::uint8_t> rgba);

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
    float alpha(const glm::vec2& uv) const;  // of the full image
    float log2_texels() const { return log2_texels_; }
    int width() const { return mips_[0].width; }
    int height() const { return mips_[0].height; }

  private:
    struct Mip {
        int width, height;
        std::vector<std::uint8_t> rgba;
    };
    std::vector<Mip> mips_;
    std::vector<std::uint8_t> alpha_;  // of the full image, by itself; empty where it is 1 everywhere
    float log2_texels_;

    static LAB_INLINE glm::vec3 bilinear(const Mip& mip, const glm::vec2& uv) {
        const TexelSquare f = texel_square(mip.width, mip.height, uv);
        const float high = f.fx * f.fy, weight[4] = {1 - f.fx - f.fy + high, f.fx - high, f.fy - high, high};
        glm::vec3 sum(0.0f);
        for (int k = 0; k < 4; ++k) {
            const std::uint8_t* p = mip.rgba.data() + 4 * f.texel[k];
            sum += weight[k] * glm::vec3(linear_of_srgb[p[0]], linear_of_srgb[p[1]], linear_of_srgb[p[2]]);
        }
        return sum;
    }
};

}  // namespace lab
