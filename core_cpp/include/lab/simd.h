// One binary for every processor: hot loops are compiled for each of these instruction sets by Highway
// (foreach_target.h) and chosen when the program runs.
#pragma once

#include <hwy/base.h>

#include <string>
#include <vector>

// For small functions that hot loops call: inlined, they are compiled for the instruction set of their caller.
#define LAB_INLINE HWY_INLINE

namespace lab {

// The sets that this processor and this build have, best first: of avx512, avx2, sse4, neon and the like.
std::vector<std::string> simd_choices();

// The one in use.
std::string simd();

// Uses `name` from now on; not while a stage runs. Throws std::invalid_argument for any but simd_choices().
void set_simd(const std::string& name);

}  // namespace lab
