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

const std::array<float, 256>& linear_table() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> t{};
        for (int i = 0; i < 256; ++i) t[i] = srgb_to_linear(static_cast<float>(i) / 255.0f);
        return t;
    }();
    return table;
}

// The four texels around a point and the weights between them.
struct Footprint {
    std::size_t texel[4];
    float fx, fy;
};

Footprint footprint(int width, int height, const glm::vec2& uv) {
    const auto place = [](float t, int size, int& low, int& high) {
        // Wrap first: a huge or broken coordinate must not overflow the conversion to int.
        const float wrapped = std::isfinite(t) ? t - std::floor(t) : 0.0f;
        const float x = wrapped * static_cast<float>(size) - 0.5f;
        const float whole = std::floor(x);
        low = (static_cast<int>(whole) + size) % size;
        high = (low + 1) % size;
        return x - whole;
    };
    int x0, x1, y0, y1;
    Footprint f;
    f.fx = place(uv.x, width, x0, x1);
    f.fy = place(uv.y, height, y0, y1);
    const auto at = [&](int x, int y) { return (static_cast<std::size_t>(y) * width + x) * 4; };
    f.texel[0] = at(x0, y0);
    f.texel[1] = at(x1, y0);
    f.texel[2] = at(x0, y1);
    f.texel[3] = at(x1, y1);
    return f;
}

}  // namespace

Texture::Texture(int width, int height, std::span<const std::uint8_t> rgba) {
    mips_.push_back({width, height, {rgba.begin(), rgba.end()}});
    const auto& linear = linear_table();
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

glm::vec4 Texture::bilinear(const Mip& mip, const glm::vec2& uv) {
    const auto& linear = linear_table();
    const Footprint f = footprint(mip.width, mip.height, uv);
    const auto fetch = [&](int k) {
        const std::uint8_t* p = mip.rgba.data() + f.texel[k];
        return glm::vec4(linear[p[0]], linear[p[1]], linear[p[2]], static_cast<float>(p[3]) / 255.0f);
    };
    return glm::mix(glm::mix(fetch(0), fetch(1), f.fx), glm::mix(fetch(2), fetch(3), f.fx), f.fy);
}

glm::vec4 Texture::sample(const glm::vec2& uv, float level) const {
    const float last = static_cast<float>(mips_.size() - 1);
    const float l = level > 0 ? std::min(level, last) : 0.0f;  // NaN falls to 0
    const auto low = static_cast<std::size_t>(l);
    const glm::vec4 fine = bilinear(mips_[low], uv);
    const float fraction = l - static_cast<float>(low);
    return fraction > 0 ? glm::mix(fine, bilinear(mips_[low + 1], uv), fraction) : fine;
}

float Texture::alpha(const glm::vec2& uv) const {
    const Mip& mip = mips_[0];
    const Footprint f = footprint(mip.width, mip.height, uv);
    const auto fetch = [&](int k) { return static_cast<float>(mip.rgba[f.texel[k] + 3]) / 255.0f; };
    return glm::mix(glm::mix(fetch(0), fetch(1), f.fx), glm::mix(fetch(2), fetch(3), f.fx), f.fy);
}

}  // namespace lab
