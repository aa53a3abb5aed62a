// Groups of pixels of a picture, each with lights all of which reach all of its pixels: what a limit of lighting is
// measured on.
#pragma once

#include <vector>

#include "lab/light_block.h"

namespace lab {

struct PerfectList {
    PixelGroup group;
    std::vector<ReadyLight> lights;
};

// About `wanted` of them, from all over the picture; none where no light reaches a whole group.
std::vector<PerfectList> perfect_lists(const LightFrame& frame, std::size_t wanted);

}  // namespace lab
