#include "lab/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace lab {
namespace {

// IEC 61966-2-1.
float srgb_to_linear(float s) {
    return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}
float linear_to_srgb(float l) {
    return l <= 0.0031308f ? l * 12.92f : 1.055f * std::pow(l, 1 / 2.4f) - 0.055f;
}

std::size_t row_bytes(const Mip& mip) {
    return 4 * (static_cast<std::size_t>(mip.width) + 1);
}

std::size_t bytes_of(const Mip& mip) {
    return row_bytes(mip) * (static_cast<std::size_t>(mip.height) + 1);
}

void copy_rows(const Mip& mip, std::span<const std::uint8_t> rgba, std::uint8_t* texels) {
    const std::size_t row = 4 * static_cast<std::size_t>(mip.width);
    for (int y = 0; y < mip.height; ++y) std::memcpy(texels + y * row_bytes(mip), rgba.data() + y * row, row);
}

// The next level: means of 2 x 2 texels, of colour in linear light.
void halve(const Mip& from, const Mip& to, std::uint8_t* texels) {
    const std::size_t row = row_bytes(from);
    for (int y = 0; y < to.height; ++y)
        for (int x = 0; x < to.width; ++x)
            for (int c = 0; c < 4; ++c) {
                float sum = 0;
                for (int k = 0; k < 4; ++k) {
                    const int sx = std::min(2 * x + (k & 1), from.width - 1);
                    const int sy = std::min(2 * y + (k >> 1), from.height - 1);
                    const std::uint8_t s = from.rgba[sy * row + 4 * static_cast<std::size_t>(sx) + c];
                    sum += c < 3 ? linear_of_srgb[s] : static_cast<float>(s) / 255.0f;
                }
                const float mean = c < 3 ? linear_to_srgb(sum / 4) : sum / 4;
                texels[y * row_bytes(to) + 4 * static_cast<std::size_t>(x) + c] =
                    static_cast<std::uint8_t>(std::lround(std::clamp(mean, 0.0f, 1.0f) * 255.0f));
            }
}

void repeat_edges(const Mip& mip, std::uint8_t* texels) {
    const std::size_t row = row_bytes(mip);
    for (int y = 0; y < mip.height; ++y) std::memcpy(texels + (y + 1) * row - 4, texels + y * row, 4);
    std::memcpy(texels + mip.height * row, texels, row);
}

}  // namespace

const std::array<float, 256> linear_of_srgb = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = srgb_to_linear(static_cast<float>(i) / 255.0f);
    return t;
}();

Texture::Texture(int width, int height, std::span<const std::uint8_t> rgba) {
    std::size_t bytes = 0;
    for (int w = width, h = height;; w = std::max(1, w / 2), h = std::max(1, h / 2)) {
        mips_.push_back({nullptr, w, h});
        bytes += bytes_of(mips_.back());
        if (w == 1 && h == 1) break;
    }
    texels_.resize(bytes);
    std::uint8_t* level = texels_.data();
    for (std::size_t m = 0; m < mips_.size(); ++m) {
        Mip& mip = mips_[m];
        mip.rgba = level;
        if (m == 0)
            copy_rows(mip, rgba, level);
        else
            halve(mips_[m - 1], mip, level);
        repeat_edges(mip, level);
        level += bytes_of(mip);
    }
    const std::size_t texels = rgba.size() / 4;
    log2_texels_ = std::log2(static_cast<float>(texels));
    std::size_t opaque = 0;
    while (opaque < texels && rgba[4 * opaque + 3] == 255) ++opaque;
    if (opaque == texels) return;
    alpha_.resize(bytes_of(mips_[0]) / 4);
    for (std::size_t i = 0; i < alpha_.size(); ++i) alpha_[i] = texels_[4 * i + 3];
}

float Texture::alpha(const glm::vec2& uv) const {
    if (alpha_.empty()) return 1.0f;
    const TexelSquare f = texel_square(width(), height(), uv);
    const std::uint8_t *upper = alpha_.data() + f.first, *lower = upper + width() + 1;
    const auto mean = [&](const std::uint8_t* p) { return glm::mix<float>(p[0] / 255.0f, p[1] / 255.0f, f.fx); };
    return glm::mix(mean(upper), mean(lower), f.fy);
}

}  // namespace lab
