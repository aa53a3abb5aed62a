#include "lab/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace lab {
namespace {

// IEC 61966-2-1.
float srgb_to_linear(float s) {
    return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}
float linear_to_srgb(float l) {
    return l <= 0.0031308f ? l * 12.92f : 1.055f * std::pow(l, 1 / 2.4f) - 0.055f;
}

const std::array<float, 256> linear_of_srgb = [] {
    std::array<float, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = srgb_to_linear(static_cast<float>(i) / 255.0f);
    return t;
}();

std::uint32_t bits_of(std::uint8_t srgb) {
    constexpr std::uint32_t half = (texel_bits & -texel_bits) / 2;  // of the last bit that is kept
    return (std::bit_cast<std::uint32_t>(linear_of_srgb[srgb] + texel_bias) + half) & texel_bits;
}

Texel texel_of(const std::uint8_t* rgb) {
    const std::uint32_t blue = bits_of(rgb[2]);
    const std::uint32_t low = bits_of(rgb[0]) | std::rotr(blue & blue_low, blue_low_turn);
    const std::uint32_t high = bits_of(rgb[1]) | std::rotr(blue & blue_high, blue_high_turn);
    return Texel{high} << 32 | low;
}

struct Image {
    int width, height;
    std::vector<std::uint8_t> rgb;

    const std::uint8_t* at(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

Image without_alpha(int width, int height, std::span<const std::uint8_t> rgba) {
    Image image{width, height, std::vector<std::uint8_t>(rgba.size() / 4 * 3)};
    for (std::size_t i = 0; i < rgba.size() / 4; ++i) std::copy_n(&rgba[4 * i], 3, &image.rgb[3 * i]);
    return image;
}

// The next level: means of 2 x 2 texels, of colour in linear light.
Image halve(const Image& from) {
    Image to{std::max(1, from.width / 2), std::max(1, from.height / 2), {}};
    for (int y = 0; y < to.height; ++y)
        for (int x = 0; x < to.width; ++x)
            for (int c = 0; c < 3; ++c) {
                float sum = 0;
                for (int k = 0; k < 4; ++k)
                    sum += linear_of_srgb[from.at(std::min(2 * x + (k & 1), from.width - 1),
                                                  std::min(2 * y + (k >> 1), from.height - 1))[c]];
                const float mean = linear_to_srgb(sum / 4);
                to.rgb.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(mean, 0.0f, 1.0f) * 255.0f)));
            }
    return to;
}

std::size_t stored(const Mip& mip) {
    return (static_cast<std::size_t>(mip.width) + 1) * (static_cast<std::size_t>(mip.height) + 1);
}

Mip append(const Image& image, Buffer<Texel>& texels) {
    const std::size_t first = texels.size();
    const Mip mip{static_cast<std::uint32_t>(first), image.width, image.height, 0};
    if (first + stored(mip) > std::numeric_limits<std::uint32_t>::max())
        throw std::length_error("the scene's textures have more than 2^32 texels");
    texels.resize(first + stored(mip));
    Texel* to = &texels[first];
    for (int y = 0; y <= image.height; ++y)
        for (int x = 0; x <= image.width; ++x)
            *to++ = texel_of(image.at(x < image.width ? x : 0, y < image.height ? y : 0));
    return mip;
}

}  // namespace

Texture::Texture(int width, int height, std::span<const std::uint8_t> rgba, Buffer<Texel>& texels) {
    for (Image image = without_alpha(width, height, rgba);; image = halve(image)) {
        mips_.push_back(append(image, texels));
        if (image.width == 1 && image.height == 1) break;
    }
    std::size_t opaque = 0;
    while (opaque < rgba.size() / 4 && rgba[4 * opaque + 3] == 255) ++opaque;
    if (opaque == rgba.size() / 4) return;
    alpha_.reserve(stored(mips_[0]));
    for (int y = 0; y <= height; ++y)
        for (int x = 0; x <= width; ++x)
            alpha_.push_back(rgba[4 * (static_cast<std::size_t>(y % height) * width + x % width) + 3]);
}

float Texture::alpha(const glm::vec2& uv) const {
    if (alpha_.empty()) return 1.0f;
    const TexelSquare f = texel_square(width(), height(), uv);
    const std::uint8_t *upper = alpha_.data() + f.first, *lower = upper + width() + 1;
    const auto mean = [&](const std::uint8_t* p) { return glm::mix<float>(p[0] / 255.0f, p[1] / 255.0f, f.fx); };
    return glm::mix(mean(upper), mean(lower), f.fy);
}

}  // namespace lab
