// Shadow rays that are traced together, and what each adds where if it is free.
#pragma once

#include <vector>

#include "lab/scene.h"

namespace lab {

class RayBatch {
  public:
    void push(const Ray& ray, std::size_t to, const vec3& add) {
        rays_.push_back(ray);
        target_.push_back(to);
        adds_.push_back(add);
    }

    // Traces every ray, calls visit(target, add, free) for each, and forgets them.
    template <class Visit>
    void trace(const Scene& scene, Coherence coherence, const Visit& visit) {
        free_.resize(rays_.size());
        scene.rays().visible(rays_, free_, coherence);
        for (std::size_t i = 0; i < rays_.size(); ++i) visit(target_[i], adds_[i], free_[i] != 0);
        rays_.clear();
        target_.clear();
        adds_.clear();
    }

    // Traces, and adds what arrives to `sums`.
    void gather(const Scene& scene, Coherence coherence, std::span<vec3> sums) {
        trace(scene, coherence, [&](std::size_t to, const vec3& add, bool free) {
            if (free) sums[to] += add;
        });
    }

  private:
    std::vector<Ray> rays_;
    std::vector<std::size_t> target_;
    std::vector<vec3> adds_;
    std::vector<std::uint8_t> free_;
};

}  // namespace lab
