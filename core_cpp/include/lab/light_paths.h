// The scene's lights as sources of light paths: chosen in proportion to their power.
#pragma once

#include <numbers>
#include <vector>

#include "lab/random.h"
#include "lab/scene.h"

namespace lab {

// A ray of light and the power it carries if it were the only path.
struct EmittedRay {
    Ray ray;
    vec3 flux;
};

class LightPaths {
  public:
    explicit LightPaths(const Scene& scene);

    bool empty() const { return sources_.empty(); }
    EmittedRay emit(std::uint32_t path, std::uint32_t key) const;

  private:
    enum class Kind { sun, point, spot, emitters };
    struct Source {
        Kind kind;
        std::size_t index;
        double cumulative;  // share of the power of all sources up to and with it
        float probability;
    };
    // Directions around an axis; spread = 1 - cos of the half angle.
    struct Cone {
        vec3 axis;
        float spread;

        float solid_angle() const { return 2 * std::numbers::pi_v<float> * spread; }
    };
    const Scene& scene_;
    std::vector<Source> sources_;

    // The directions from `position` that can meet the scene: a lamp far off wastes no paths on empty space.
    Cone toward_scene(const vec3& position) const;

    EmittedRay emit_from(const Source& source, const Random4& a, const Random4& b) const;
};

}  // namespace lab
