#include "lab/ready_light.h"

#include <cmath>

#include "lab/luminance.h"

namespace lab {

ReadyLight ready_light(const HierarchyView& h, std::size_t index, int level, const LightSettings& settings,
                       float deal_scale) {
    ReadyLight light{light_term(h, index, level, settings, deal_scale), 0, 0, 0, 0, 0, 0, 0, 0};
    const EmissionLobe& lobe = light.lobe;
    light.bright = luminance(light.intensity);
    light.inner = light.blend.up_slope > 0 ? light.inner_radius : 0.0f;
    light.outer = level == h.top() ? std::numeric_limits<float>::infinity() : 4 * light.inner_radius;
    constexpr float slack = 1e-5f;
    light.least2 = light.inner * light.inner * (1 - slack);
    light.most2 = light.outer * light.outer * (1 + slack);
    // Along w the sum is m.w + sqrt(w^T M w), and no eigenvalue of M exceeds its trace. A constant shines everywhere.
    const float trace = lobe.moment.xx + lobe.moment.yy + lobe.moment.zz;
    light.steepness = lobe.constant > 0 ? 1e30f : glm::length(lobe.mean) + std::sqrt(trace);
    light.index = static_cast<std::uint32_t>(index);
    light.level = static_cast<std::uint32_t>(level);
    return light;
}

ReadyLights::ReadyLights(const HierarchyView& hierarchy, const LightSettings& settings, std::vector<float> deal_scales)
    : hierarchy_(hierarchy), settings_(settings), deal_scales_(std::move(deal_scales)), first_(hierarchy.offset[1]) {
    coarse_.resize(hierarchy.position.size() - first_);
    for (int level = std::max(1, settings.first_level); level <= hierarchy.top(); ++level)
#pragma omp parallel for
        for (std::int64_t i = hierarchy.offset[level]; i < hierarchy.offset[level + 1]; ++i)
            coarse_[i - first_] = ready_light(hierarchy, i, level, settings_, deal_scales_[level]);
}

}  // namespace lab
