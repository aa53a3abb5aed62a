// The order that rays of neighbouring pixels are traced in, by where they end; and packets of rays in any order.
#pragma once

#include <span>

#include "lab/ray_packet.h"
#include "lab/scene.h"

namespace lab {

// A sample of a block of pixels and, above it, the place where its ray ends.
using RayKey = std::uint32_t;

// Cells of a cube around the scene, along a curve that fills it: near cells have near numbers.
class RayOrder {
  public:
    static constexpr int axis_bits = 6, sample_bits = 32 - 3 * axis_bits;
    static constexpr int slack = 16;  // keys are written a vector at a time

    explicit RayOrder(const Scene& scene)
        : low_(scene.centre() - scene.radius()), cells_((1 << axis_bits) / (2 * scene.radius())) {}

    // Appends the keys of samples first.. that end at `points` and have a share, and returns the end of all.
    RayKey* append(std::span<const vec3> points, const float* share, std::uint32_t first, RayKey* keys) const;

    vec3 low() const { return low_; }
    float cells() const { return cells_; }  // a length unit

  private:
    vec3 low_;
    float cells_;
};

// Where a packet's rays start. The fourth number is 0, like the start of all.
struct RayOrigin {
    vec3 of;
    float zero = 0.0f;
};

// The samples of a block of pixels: numbered pixel by pixel, with as many to each.
struct BlockSamples {
    int side_bits;              // of the pixels, 2^side_bits x 2^side_bits
    int each;                   // samples a pixel
    std::uint32_t image_width;  // pixels from one row of the block to the next, in the image
    const RayOrigin* origin;    // of the block's pixels
    const vec3* point;          // of the image's samples, from the block's first on; a fourth number is read with each
};

// The samples of a packet on its way.
struct PacketSamples {
    std::uint32_t sample[RayPacket::size], pixel[RayPacket::size];  // numbers in the block
    std::uint32_t point[RayPacket::size];
};

// Finds the samples of RayPacket::size keys, and asks for what fill_packet() will read of them.
void find_samples(const BlockSamples& block, const RayKey* keys, PacketSamples& samples);
// Rays of `length` ways to the samples' points.
void fill_packet(const BlockSamples& block, const PacketSamples& samples, float length, RayPacket& packet);

}  // namespace lab
