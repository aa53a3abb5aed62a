// Sums over the shadow samples of each pixel: S and U of the estimators that count light by its brightness (LY19 3.3).
#pragma once

#include <cstddef>
#include <cstdint>

#include "lab/params.h"

namespace lab {

// A row of pixels, `each` samples to a pixel, side by side.
struct SampleRow {
    const std::int32_t* light;
    const float* omega;
    const std::uint8_t* free;
    int each;
    std::size_t pixels;
};

// In the order of a pixel's samples, whatever order they were traced in. Not for ShadowEstimator::ratio_rgb.
void sum_samples(const SampleRow& row, ShadowEstimator estimator, float* weight, float* shadowed);

}  // namespace lab
