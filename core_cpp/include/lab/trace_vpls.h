// Stage trace_vpls: virtual point lights where light paths meet surfaces (LY19 4; Keller 1997).
#pragma once

#include <stdexcept>

#include "lab/params.h"
#include "lab/scene.h"

namespace lab {

struct VplData {
    std::vector<vec3> position, flux, normal;
    std::int64_t paths_launched = 0;
};

// Exactly params.vpls lights, the same for any thread count. Throws UnlitScene where light reaches (almost)
// nothing.
VplData trace_vpls(const Scene& scene, const Params& params);

struct UnlitScene : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace lab
