// The order that rays of neighbouring pixels are traced in, by where they end; and packets of rays in any order.
#pragma once

#include <span>

#include "lab/ray_packet.h"
#include "lab/scene.h"

namespace lab {

// Cells of a cube around the scene, along a curve that fills it: near cells have near numbers.
class RayOrder {
  public:
    static constexpr int axis_bits = 6, bits = 3 * axis_bits;

    explicit RayOrder(const Scene& scene)
        : low_(scene.centre() - scene.radius()), cells_((1 << axis_bits) / (2 * scene.radius())) {}

    // The cells of points.
    void places(std::span<const vec3> points, std::uint32_t* place) const;

    vec3 low() const { return low_; }
    float cells() const { return cells_; }  // a length unit

  private:
    vec3 low_;
    float cells_;
};

// Origin or direction of a ray. The fourth number of both is 0: where a packet's rays start, and their time.
struct RayRow {
    vec3 of;
    float zero = 0.0f;
};

// Rays from origins[origin[i]] along directions[direction[i]], i < RayPacket::size; their lengths stay as they are.
void fill_packet(const RayRow* origins, const std::uint32_t* origin, const RayRow* directions,
                 const std::uint32_t* direction, RayPacket& packet);

}  // namespace lab
