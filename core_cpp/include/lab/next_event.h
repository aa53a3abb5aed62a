// Next-event estimation: light that reaches a point straight from the scene's lights, however many there are.
#pragma once

#include <vector>

#include "lab/direct_light.h"
#include "lab/ray_batch.h"
#include "lab/records.h"

namespace lab {

// Numbers a decision of a path: random numbers are hashed from it.
struct PathVertex {
    std::uint32_t path, bounce, key;
};

class NextEvent {
  public:
    // `list`: a user's own point lights (as records: position, flux, normal or zero); may be empty.
    NextEvent(const Scene& scene, const LightsView& list);

    // Pushes the rays that together are an unbiased estimate of the irradiance at a point: one to each sun, one to one
    // of the point lights, one to the emissive triangles. What arrives is multiplied by `scale`.
    void push(const LitPoint& at, const PathVertex& vertex, const vec3& scale, std::size_t slot, RayBatch& rays) const;

  private:
    enum class Kind { point, spot, listed };
    struct Source {
        Kind kind;
        std::size_t index;
        double cumulative;  // share of the power of all sources up to and with it
        float probability;
    };
    const Scene& scene_;
    LightsView list_;
    std::vector<Source> sources_;

    DirectCandidate candidate(const Source& source, const LitPoint& at) const;
    DirectCandidate choose(const LitPoint& at, const PathVertex& vertex) const;
};

}  // namespace lab
