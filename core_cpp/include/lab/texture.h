// Textures: 8-bit sRGB with alpha, repeated, bilinear within a level and linear between mip levels.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace lab {

class Texture {
  public:
    Texture(int width, int height, std::span<const std::uint8_t> rgba);

    // Linear RGB and alpha at uv (v down); level 0 is the full image, fractions blend two mip levels.
    glm::vec4 sample(const glm::vec2& uv, float level) const;
    float alpha(const glm::vec2& uv) const;  // of the full image
    int width() const { return mips_[0].width; }
    int height() const { return mips_[0].height; }

  private:
    struct Mip {
        int width, height;
        std::vector<std::uint8_t> rgba;
    };
    std::vector<Mip> mips_;

    static glm::vec4 bilinear(const Mip& mip, const glm::vec2& uv);
};

}  // namespace lab
