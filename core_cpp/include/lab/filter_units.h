// What the variance-guided filter measures values in, and where its planes hold what.
#pragma once

#include <algorithm>
#include <cmath>

namespace lab {

inline constexpr float least_deviation = 0.02f;  // relative to `scale`: smaller differences never stop the filter
inline constexpr float largest = 1e9f;           // relative to `scale`: larger values count as this where they guide
inline constexpr float any_difference = 1e9f;    // such a tolerance stops nothing, not even where there is no noise
inline constexpr float unlike = 20.0f;  // likeness of 2^-20 and less is none: nothing is known from such pixels
inline constexpr float log2_e = 1.44269504f;

// A factor as the product of two, either well inside float's range: a power of two, and the rest.
struct Factor {
    float power = 1.0f, rest = 1.0f;

    Factor() = default;
    explicit Factor(double factor) {
        factor = std::clamp(factor, 1e-70, 1e70);
        power = std::ldexp(1.0f, std::ilogb(factor) / 2);
        rest = static_cast<float>(factor / double{power});
    }
};

// How a signal's numbers become values: luminances of numerator and denominator, in units in which no sum and no square
// leaves float's range, whatever the light's.
struct Units {
    int numerators, denominators;
    Factor over, under;
    float tolerance;

    // The planes: signals first.
    int signals() const { return numerators + denominators; }
    int variance() const { return signals(); }
    int value() const { return signals() + 1; }          // luminance of the numerator, before the guide is made
    int per_deviation() const { return signals() + 2; }  // luminance of the denominator, before
};

}  // namespace lab
