// What a grid light is made of, and in what proportion its shadow points are drawn (LY19 3.3): the alias tables of
// Members in lab/records.py, followed down to the input lights.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lab/records.h"

namespace lab {

struct MemberShares {
    std::vector<std::uint32_t> member;  // input lights that may be drawn, ascending merged index
    std::vector<double> share;          // the probability of each; they sum to 1
};

// Of light `index`; an input light is its own only member.
MemberShares member_shares(const HierarchyView& hierarchy, std::uint32_t index);

// What each of the first lights of the merged buffer has (>= 0) is given to its members, in the proportion in which
// they are drawn; returns what each input light then has.
std::vector<double> member_sums(const HierarchyView& hierarchy, std::vector<double> weight);

// For each of the m lights of all levels the mean, over the draws of its members, of `columns` values that each input
// light has: (n, columns) to (m, columns), row by row. A light without members has 0.
std::vector<double> member_means(const HierarchyView& hierarchy, std::span<const double> values, std::size_t columns);

}  // namespace lab
