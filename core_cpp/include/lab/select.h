// Minimum and maximum by value: std::min and std::max hand out references, which keeps loops around them from
// being vectorised.
#pragma once

namespace lab {

inline float larger(float a, float b) {
    return a > b ? a : b;
}
inline float smaller(float a, float b) {
    return a < b ? a : b;
}
inline float magnitude(float a) {
    return a < 0.0f ? -a : a;
}

}  // namespace lab
