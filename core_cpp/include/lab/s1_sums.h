// What S1's lights are made of: the same integers on every engine, which a test compares.
#pragma once

#include <vector>

#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// Rows of column::count fixed-point sums (vertex_sums.h), one a light of S1, in grid order.
std::vector<std::int64_t> s1_sums(const LightsView& lights, const Params& params);

}  // namespace lab
