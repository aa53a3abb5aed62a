// The yardstick of stage light: what the formulas cost as they stand, in a loop that a compiler makes wide by itself.
#pragma once

#include "lab/perfect_list.h"

namespace lab {

// What a group has gathered from its list.
struct PlainSums {
    float red[group_lanes], green[group_lanes], blue[group_lanes];
    std::int32_t pick[max_shadow_samples * group_lanes];  // merged index of each sample's light
    float weight[max_shadow_samples * group_lanes];
};

// Every light of the list at every pixel of the group, with contribution.h's `receive`; shadow samples by textbook:
// a reservoir replaced with probability f / running sum (LY19 appendix A), or a race.
void plain_light(const LightSettings& settings, const PickSettings& picks, const PerfectList& list, PlainSums& sums);

}  // namespace lab
