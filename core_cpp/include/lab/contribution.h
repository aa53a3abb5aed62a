// What one grid light sends to one point: the same few lines for lighting, shadow samples and irradiance
// queries.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "lab/blending.h"
#include "lab/falloff.h"
#include "lab/lobe.h"
#include "lab/params.h"
#include "lab/records.h"
#include "lab/select.h"

namespace lab {

// A light of the merged buffer, made ready for evaluation.
struct LightTerm {
    vec3 position, intensity;  // intensity: flux / pi, times n^2 where the light is dealt to one of n^2 tiles
    EmissionLobe lobe;
    Blend blend;
    vec3 deviation;
    float inner_radius;  // r_l / 2: beyond it a soft receiver softens
};

// The settings that decide a light's term, and the scale of its lengths.
struct LightSettings {
    Lobe lobe;
    Falloff falloff;
    Receiver receiver;
    float alpha, clamp2;  // clamp2: squared clamp distance in scene units
    int first_level;

    LightSettings(const Params& params, float scene_radius)
        : lobe(params.lobe),
          falloff(params.falloff),
          receiver(params.receiver),
          alpha(params.alpha),
          clamp2(params.clamp_distance * scene_radius * (params.clamp_distance * scene_radius)),
          first_level(params.first_level) {}
};

inline float blend_radius(const HierarchyView& h, int level, const LightSettings& settings) {
    return settings.alpha * h.cell_size[level];
}

inline LightTerm light_term(const HierarchyView& h, std::size_t i, int level, const LightSettings& settings,
                            float deal_scale) {
    const float r = blend_radius(h, level, settings);
    const float scale = deal_scale / std::numbers::pi_v<float>;
    return {h.position[i],
            h.flux[i] * scale,
            make_lobe(settings.lobe, h.normal[i], h.normal_moment[i], h.oriented[i] != 0),
            make_blend(r, level == settings.first_level, level == h.top()),
            h.deviation[i],
            0.5f * r};
}

// E[max(0, t)] of a Gaussian with mean t and deviation s.
inline float softened_cosine(float t, float s) {
    if (!(s > 0)) return larger(0.0f, t);
    const float z = t / s;
    return t * 0.5f * std::erfc(-z * std::numbers::sqrt2_v<float> / 2) +
           s * std::exp(-0.5f * z * z) * (std::numbers::inv_sqrtpi_v<float> / std::numbers::sqrt2_v<float>);
}

struct Received {
    float weight;            // blend * cosine * emission * falloff: irradiance per intensity
    float cosine, emission;  // at the receiver, and of the light toward it
};

template <bool soft, bool clamped>
inline Received receive(const LightTerm& light, float clamp2, float px, float py, float pz, float nx, float ny,
                        float nz) {
    const float vx = light.position.x - px, vy = light.position.y - py, vz = light.position.z - pz;
    const float d2 = vx * vx + vy * vy + vz * vz;
    const float inverse = 1.0f / std::sqrt(larger(d2, std::numeric_limits<float>::min()));
    const float distance = d2 * inverse;
    float cosine = (nx * vx + ny * vy + nz * vz) * inverse;
    if constexpr (soft) {
        const float sx = nx * light.deviation.x, sy = ny * light.deviation.y, sz = nz * light.deviation.z;
        const float spread = std::sqrt(sx * sx + sy * sy + sz * sz) * inverse;
        cosine = distance > light.inner_radius ? softened_cosine(cosine, spread) : larger(0.0f, cosine);
    } else {
        cosine = larger(0.0f, cosine);
    }
    const float emitted = emission(light.lobe, -vx, -vy, -vz, inverse);
    const float falloff = clamped ? falloff_clamped(d2, clamp2) : falloff_softened(d2, clamp2);
    return {blend_weight(light.blend, distance) * cosine * emitted * falloff, cosine, emitted};
}

// Calls f.template operator()<soft, clamped>() for the settings' kinds.
template <class F>
decltype(auto) with_kinds(const LightSettings& settings, const F& f) {
    const bool soft = settings.receiver == Receiver::soft, clamped = settings.falloff == Falloff::clamped;
    if (soft) return clamped ? f.template operator()<true, true>() : f.template operator()<true, false>();
    return clamped ? f.template operator()<false, true>() : f.template operator()<false, false>();
}

}  // namespace lab
