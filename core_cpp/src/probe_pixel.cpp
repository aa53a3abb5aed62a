#include "lab/probe_pixel.h"

#include "lab/contribution.h"
#include "lab/interleave.h"
#include "lab/light.h"
#include "lab/luminance.h"

namespace lab {
namespace {

float largest_part(const vec3& v) {
    return larger(magnitude(v.x), larger(magnitude(v.y), magnitude(v.z)));
}

// Adds the lights of one level.
template <bool soft, bool clamped>
void probe_level(const HierarchyView& h, const ProbePoint& at, int level, float scale, bool dealt, int tiles,
                 const LightSettings& settings, ProbeData& out) {
    const float radius = blend_radius(h, level, settings);
    const bool top = level == h.top();
    const Blend blend = make_blend(radius, level == settings.first_level, top);
    const vec3 p = at.position, n = at.normal;
    for (std::int64_t i = h.offset[level]; i < h.offset[level + 1]; ++i) {
        const vec3 to = h.position[i] - p;
        const bool inside = top || largest_part(to) <= 2 * radius;
        // No light is blended in farther than its cube's faces are.
        if (!inside) continue;
        if (dealt && dealt_tile(static_cast<std::uint32_t>(i - h.offset[level]), static_cast<std::uint32_t>(level),
                                tiles) != at.tile)
            continue;
        ++out.overdraw[level];
        const float d2 = glm::dot(to, to);
        const float distance = std::sqrt(d2), weight = blend_weight(blend, distance);
        if (!(weight > 0)) continue;
        const LightTerm light = light_term(h, i, level, settings, scale);
        const Received r = receive<soft, clamped>(light, settings.clamp2, p.x, p.y, p.z, n.x, n.y, n.z);
        const float bright = r.weight * luminance(light.intensity);
        out.lights_used[level] += bright > 0 ? 1 : 0;
        out.index.push_back(static_cast<std::uint32_t>(i));
        out.level.push_back(level);
        out.distance.push_back(distance);
        out.blend.push_back(weight);
        out.cosine.push_back(r.cosine);
        out.emission.push_back(r.emission);
        out.falloff.push_back(clamped ? falloff_clamped(d2, settings.clamp2) : falloff_softened(d2, settings.clamp2));
        out.scale.push_back(scale);
        out.bright.push_back(bright);
        out.contribution.push_back(light.intensity * r.weight);
    }
}

}  // namespace

ProbeData probe_pixel(const HierarchyView& h, const ProbePoint& at, const Params& params, float scene_radius) {
    ProbeData out;
    out.overdraw.assign(h.cell_size.size(), 0);
    out.lights_used.assign(h.cell_size.size(), 0);
    const int pick_level = first_pick_level(h, params);
    out.first_pick = static_cast<std::uint32_t>(h.offset[pick_level]);
    const LightSettings settings(params, scene_radius);
    with_kinds(settings, [&]<bool soft, bool clamped>() {
        for (int level = params.first_level; level <= h.top(); ++level) {
            const float scale = deal_scale(h, level, params);
            probe_level<soft, clamped>(h, at, level, scale, scale > 1, params.interleave, settings, out);
        }
    });
    return out;
}

}  // namespace lab
