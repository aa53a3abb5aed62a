#include "lab/next_event.h"

#include <algorithm>
#include <numbers>

#include "lab/luminance.h"

namespace lab {
namespace {

// So many point lights are compared at a point before one of them gets the shadow ray.
constexpr std::uint32_t most_candidates = 16;

}  // namespace

NextEvent::NextEvent(const Scene& scene, const LightsView& list) : scene_(scene), list_(list) {
    double sum = 0;
    const auto add = [&](Kind kind, std::size_t index, double power) {
        if (!(power > 0)) return;
        sum += power;
        sources_.push_back({kind, index, sum, static_cast<float>(power)});
    };
    const SceneData& data = scene.data();
    for (std::size_t i = 0; i < data.points.size(); ++i)
        add(Kind::point, i, 4 * std::numbers::pi * luminance(data.points[i].intensity));
    for (std::size_t i = 0; i < data.spots.size(); ++i)
        add(Kind::spot, i, 4 * std::numbers::pi * luminance(data.spots[i].intensity));
    for (std::size_t i = 0; i < list.flux.size(); ++i) add(Kind::listed, i, luminance(list.flux[i]));
    for (Source& s : sources_) {
        s.cumulative /= sum;
        s.probability = static_cast<float>(s.probability / sum);
    }
}

DirectCandidate NextEvent::candidate(const Source& source, const LitPoint& at) const {
    const SceneData& data = scene_.data();
    if (source.kind == Kind::point) return from_point(scene_, data.points[source.index], at);
    if (source.kind == Kind::spot) return from_spot(scene_, data.spots[source.index], at);
    const vec3 position = list_.position[source.index], normal = list_.normal[source.index];
    vec3 intensity = list_.flux[source.index] * (0.25f * std::numbers::inv_pi_v<float>);
    if (normal != vec3(0.0f)) {
        const vec3 to = at.position - position;
        const float length = std::max(glm::length(to), std::numeric_limits<float>::min());
        intensity *= 4.0f * std::max(0.0f, glm::dot(normal, to) / length);
    }
    return from_point(scene_, {position, intensity}, at);
}

// Resampled importance sampling (Talbot et al. 2005): among a few candidates drawn by power, or all where there are
// few, one is taken in proportion to what it would send here; so near lights get the rays.
DirectCandidate NextEvent::choose(const LitPoint& at, const PathVertex& v) const {
    const auto all = static_cast<std::uint32_t>(sources_.size());
    const bool few = all <= most_candidates;
    const std::uint32_t count = few ? all : most_candidates;
    float uniform = to_unit(random4(v.path, v.bounce, Stream::light_choice, v.key).x);
    float sum = 0, taken = 1;
    DirectCandidate best{{}, vec3(0.0f)};
    for (std::uint32_t i = 0; i < count; ++i) {
        const Source* source = &sources_[std::min(i, all - 1)];
        if (!few) {
            const double u =
                random4(v.path, v.bounce * most_candidates + i, Stream::light_candidate, v.key).x * 0x1p-32;
            const auto found = std::upper_bound(sources_.begin(), sources_.end(), u,
                                                [](double x, const Source& s) { return x < s.cumulative; });
            source = &*std::min(found, sources_.end() - 1);
        }
        const DirectCandidate c = candidate(*source, at);
        const float f = luminance(c.irradiance);
        const float weight = few ? f : f / (source->probability * static_cast<float>(count));
        if (!(weight > 0)) continue;
        sum += weight;
        const float take = weight / sum;
        if (uniform < take) {
            uniform /= take;
            best = c;
            taken = f;
        } else {
            uniform = (uniform - take) / (1 - take);
        }
    }
    best.irradiance *= sum / taken;
    return best;
}

void NextEvent::push(const LitPoint& at, const PathVertex& v, const vec3& scale, std::size_t slot,
                     RayBatch& rays) const {
    const auto add = [&](const DirectCandidate& c) {
        if (c.irradiance != vec3(0.0f)) rays.push(c.ray, slot, c.irradiance * scale);
    };
    for (const SunLight& sun : scene_.data().suns) add(from_sun(scene_, sun, at));
    if (!sources_.empty()) add(choose(at, v));
    if (!scene_.emitters().empty())
        add(from_emitters(scene_, at, random4(v.path, v.bounce, Stream::light_point, v.key)));
}

}  // namespace lab
