// Sixteen rays side by side, component by component: what the ray tracer takes without rearranging.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>

#include "lab/simd.h"

namespace lab {

enum class Coherence { coherent, incoherent };

// In the order of Embree's own packet (ray_tracer.cpp checks it). `length` of a ray turns negative where it is blocked.
struct alignas(64) RayPacket {
    static constexpr int size = 16;
    float origin_x[size], origin_y[size], origin_z[size], start[size] = {};
    float direction_x[size], direction_y[size], direction_z[size], time[size] = {};
    float length[size];
    std::uint32_t mask[size], id[size] = {}, flags[size] = {};

    RayPacket() {
        for (std::uint32_t& m : mask) m = 0xffffffffu;
    }

    LAB_INLINE void set(int i, const glm::vec3& origin, const glm::vec3& direction, float ray_length) {
        origin_x[i] = origin.x;
        origin_y[i] = origin.y;
        origin_z[i] = origin.z;
        direction_x[i] = direction.x;
        direction_y[i] = direction.y;
        direction_z[i] = direction.z;
        length[i] = ray_length;
    }

    // Rays from `count` on, which are not traced, get the values of the last: nothing in a packet is left unset.
    void pad(int count) {
        for (int i = count; i < size; ++i)
            set(i, {origin_x[count - 1], origin_y[count - 1], origin_z[count - 1]},
                {direction_x[count - 1], direction_y[count - 1], direction_z[count - 1]}, length[count - 1]);
    }
};

// What becomes of the rays of part `block` of an image: bit i of the answer tells whether ray i < count is free.
using TracePacket = std::function<std::uint32_t(std::size_t block, RayPacket& packet, int count, Coherence coherence)>;

}  // namespace lab
