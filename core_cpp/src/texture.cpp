#include "lab/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lab {
namespace {

// IEC 61966-2-1.
float srgb_to_linear(float s) {
    return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}
float linear_to_srgb(float l) {
    return l <= 0.0031308f ? l * 12.92f : 1.055f * std::pow(l, 1 / 2.4f) - 0.055f;
}

}  // namespace

const std::array<float, 256> linear_of_srgb = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = srgb_to_linear(static_cast<float>(i) / 255.0f);
    return t;
}();

Texture::Texture(int width, int height, std::span<const std::uint8_t> rgba) {
    mips_.push_back({width, height, {rgba.begin(), rgba.end()}});
    const auto& linear = linear_of_srgb;
    const auto is_clear = [&](std::size_t texel) { return rgba[4 * texel + 3] != 255; };
    const std::size_t texels = rgba.size() / 4;
    std::size_t first_clear = 0;
    while (first_clear < texels && !is_clear(first_clear)) ++first_clear;
    if (first_clear < texels) {
        alpha_.resize(texels);
        for (std::size_t i = 0; i < texels; ++i) alpha_[i] = rgba[4 * i + 3];
    }
    log2_texels_ = std::log2(static_cast<float>(texels));
    while (mips_.back().width > 1 || mips_.back().height > 1) {
        const Mip& from = mips_.back();
        Mip to{std::max(1, from.width / 2), std::max(1, from.height / 2), {}};
        to.rgba.resize(static_cast<std::size_t>(to.width) * to.height * 4);
        for (int y = 0; y < to.height; ++y)
            for (int x = 0; x < to.width; ++x)
                for (int c = 0; c < 4; ++c) {
                    float sum = 0;
                    for (int k = 0; k < 4; ++k) {
                        const int sx = std::min(2 * x + (k & 1), from.width - 1);
                        const int sy = std::min(2 * y + (k >> 1), from.height - 1);
                        const std::uint8_t s = from.rgba[(static_cast<std::size_t>(sy) * from.width + sx) * 4 + c];
                        sum += c < 3 ? linear[s] : static_cast<float>(s) / 255.0f;
                    }
                    const float mean = c < 3 ? linear_to_srgb(sum / 4) : sum / 4;
                    to.rgba[(static_cast<std::size_t>(y) * to.width + x) * 4 + c] =
                        static_cast<std::uint8_t>(std::lround(std::clamp(mean, 0.0f, 1.0f) * 255.0f));
                }
        mips_.push_back(std::move(to));
    }
}

float Texture::alpha(const glm::vec2& uv) const {
    if (alpha_.empty()) return 1.0f;
    const TexelSquare f = texel_square(mips_[0].width, mips_[0].height, uv);
    const auto fetch = [&](int k) { return static_cast<float>(alpha_[f.texel[k]]) / 255.0f; };
    return glm::mix(glm::mix(fetch(0), fetch(1), f.fx), glm::mix(fetch(2), fetch(3), f.fx), f.fy);
}

}  // namespace lab
