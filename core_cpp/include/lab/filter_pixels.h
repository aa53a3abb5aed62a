// Pixels as the stages hand them on, one after the other, to planes and back.
#pragma once

#include <limits>
#include <span>

#include "lab/filter_planes.h"
#include "lab/records.h"

namespace lab {

// A line of RGB or xyz: plane = min(max((pixel - offset) * factor, -limit), limit) * scale
struct PixelScale {
    vec3 offset{0.0f};
    float factor = 1.0f, limit = std::numeric_limits<float>::max(), scale = 1.0f;
};

// The planes lie `stride` floats apart and may be written a vector's width beyond the line's end.
void to_planes(std::span<const vec3> pixels, const PixelScale& scale, float* plane, std::size_t stride);
void to_pixels(const float* plane, std::size_t stride, std::span<vec3> pixels);

// Pictures of 1 or 3 numbers a pixel, to the planes from `first` on and back.
void deal(std::span<const float> pixels, int channels, int first, Planes& planes);
void collect(const Planes& planes, int first, int channels, std::span<float> pixels);

// Sum of the luminance of pixels that are surfaces.
double luminance_sum(std::span<const vec3> pixels, const float* depth);

}  // namespace lab
