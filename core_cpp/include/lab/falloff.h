// Geometry term G of a point light: the inverse square, kept finite (LY19 2.1).
#pragma once

#include <limits>
#include "lab/select.h"

#include "lab/params.h"

namespace lab {

// c2 = squared clamp distance. A light in the very point it lights has cosine 0, so G only needs to be
// finite.
inline float falloff_clamped(float d2, float c2) {
    return 1.0f / larger(larger(d2, c2), std::numeric_limits<float>::min());
}

inline float falloff_softened(float d2, float c2) {
    return 1.0f / larger(d2 + c2, std::numeric_limits<float>::min());
}

}  // namespace lab
