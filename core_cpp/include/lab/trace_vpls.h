// Stage trace_vpls: virtual point lights where light paths meet surfaces (LY19 4; Keller 1997).
#pragma once

#include <functional>
#include <span>
#include <stdexcept>

#include "lab/buffer.h"
#include "lab/params.h"
#include "lab/scene.h"

namespace lab {

struct VplData {
    Buffer<vec3> position, flux, normal;
    std::int64_t paths_launched = 0;
};

// Exactly params.vpls lights, the same for any thread count. Throws UnlitScene where light reaches (almost)
// nothing. `see`, if any, is shown all rays before they are traced, those of a few paths at a time, by any thread.
using SeeRays = std::function<void(std::span<const Ray>)>;
VplData trace_vpls(const Scene& scene, const Params& params, const SeeRays& see = {});

struct UnlitScene : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace lab
