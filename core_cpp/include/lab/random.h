// Counter-based random numbers: a hash of what is being decided, so that any thread, order or engine gets the
// same.
#pragma once

#include <cstdint>

namespace lab {

// What a random number is for; keeps the decisions of one pixel or path apart.
enum class Stream : std::uint32_t {
    emit = 1,
    bounce,
    pick,
    race,
    member,
    jitter,
    area,
    // The references.
    pixel_point,
    path_direction,
    light_point,
    light_choice,
    light_candidate,
    reference_pick,
};

struct Random4 {
    std::uint32_t x, y, z, w;
};

// PCG4D of Jarzynski & Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
inline Random4 pcg4d(Random4 v) {
    v.x = v.x * 1664525u + 1013904223u;
    v.y = v.y * 1664525u + 1013904223u;
    v.z = v.z * 1664525u + 1013904223u;
    v.w = v.w * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v.x ^= v.x >> 16;
    v.y ^= v.y >> 16;
    v.z ^= v.z >> 16;
    v.w ^= v.w >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The next of a sequence of numbers (RXS-M-XS of O'Neill, "PCG", 2014), for decisions that come one after another.
inline std::uint32_t pcg(std::uint32_t& state) {
    state = state * 747796405u + 2891336453u;
    const std::uint32_t word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
    return word >> 22 ^ word;
}

// One key for the whole frame, to be mixed into every hash.
inline std::uint32_t frame_key(std::uint32_t seed, std::uint32_t frame) {
    return pcg4d({seed, frame, 0x9e3779b9u, 0x85ebca6bu}).x;
}

// Four independent numbers for (what, which, stream) of a frame. `what` is a pixel or a path, `which` a
// counter.
inline Random4 random4(std::uint32_t what, std::uint32_t which, Stream stream, std::uint32_t key) {
    return pcg4d({what, which, static_cast<std::uint32_t>(stream), key});
}

// [0, 1) with 24 bits.
inline float to_unit(std::uint32_t bits) {
    return static_cast<float>(bits >> 8) * 0x1p-24f;
}

}  // namespace lab
