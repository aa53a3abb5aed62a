// Grid lights made ready to light a picture: their terms, and what the search for those in reach needs to know.
#pragma once

#include <span>

#include "lab/buffer.h"
#include "lab/contribution.h"

namespace lab {

struct ReadyLight : LightTerm {
    float bright;         // luminance of the intensity
    float inner, outer;   // radii that its blend begins and ends at
    float steepness;      // the lobe's sum changes by at most this much per length of the vector it is taken along
    float least2, most2;  // squares of those radii, with a little to spare for rounding
    std::uint32_t index, level;
};

// One input or grid light. `deal_scale`: what it counts for in its interleaving tile.
ReadyLight ready_light(const HierarchyView& hierarchy, std::size_t index, int level, const LightSettings& settings,
                       float deal_scale);

// The lights of the levels above 0, made once a frame. Input lights, the most by far, of which a picture sees few,
// are made when they are met.
class ReadyLights {
  public:
    ReadyLights(const HierarchyView& hierarchy, const LightSettings& settings, std::vector<float> deal_scales);

    ReadyLight of(std::uint32_t index, int level) const {
        return level == 0 ? ready_light(hierarchy_, index, 0, settings_, deal_scales_[0]) : coarse_[index - first_];
    }

  private:
    const HierarchyView& hierarchy_;
    LightSettings settings_;
    std::vector<float> deal_scales_;  // of the levels
    std::size_t first_;               // merged index of coarse_[0]
    Buffer<ReadyLight> coarse_;
};

}  // namespace lab
