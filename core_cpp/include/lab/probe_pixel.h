// Why a pixel is lit as it is: every grid light that reaches it, term by term (LY19 3.2, 3.3). One light after the
// other, by the small pure headers: a second opinion on what stage light does in groups and vectors.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/params.h"
#include "lab/records.h"

namespace lab {

struct ProbePoint {
    vec3 position, normal;
    int tile;  // interleaving tile, see interleave.h
};

// One row a light whose blend weight is above zero, ascending.
struct ProbeData {
    std::vector<std::uint32_t> index;  // merged
    std::vector<std::int32_t> level;
    std::vector<float> distance, blend, cosine, emission, falloff, scale;
    std::vector<float> bright;       // luminance of the contribution
    std::vector<vec3> contribution;  // irradiance: blend * cosine * emission * falloff * scale * flux / pi
    std::vector<std::uint32_t> overdraw, lights_used;  // of each level
    std::uint32_t first_pick;                          // merged index that shadow samples are picked from, up
};

// The lights of the point's interleaving tile. `params`: those of stage light.
ProbeData probe_pixel(const HierarchyView& hierarchy, const ProbePoint& at, const Params& params, float scene_radius);

}  // namespace lab
