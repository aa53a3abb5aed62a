#include "lab/trace_shadow_rays.h"

#include <algorithm>

#include "lab/contribution.h"
#include "lab/direct_light.h"
#include "lab/draw_member.h"
#include "lab/light.h"
#include "lab/ray_batch.h"
#include "lab/trace_paths.h"

namespace lab {
namespace {

Received receive_at(const LightTerm& light, const LightSettings& settings, const LitPoint& at) {
    return with_kinds(settings, [&]<bool soft, bool clamped>() {
        return receive<soft, clamped>(light, settings.clamp2, at.position.x, at.position.y, at.position.z, at.normal.x,
                                      at.normal.y, at.normal.z);
    });
}

// A shadow sample before its ray is traced.
struct Sample {
    vec3 point{0.0f};
    std::int32_t member = -1;
    float omega = 0.0f;
    vec3 share{0.0f};  // what S and its weight are made of, per channel
};

class Sampler {
  public:
    Sampler(const HierarchyView& hierarchy, const Params& params, float scene_radius)
        : h_(hierarchy), params_(params), settings_(params, scene_radius), key_(frame_key(params.seed, params.frame)) {
        for (int level = 0; level <= h_.top(); ++level) scale_.push_back(deal_scale(h_, level, params));
    }

    Sample draw(const LitPoint& at, std::uint32_t pixel, int sample, std::uint32_t pick, float f, float sum) const {
        const int level =
            static_cast<int>(std::upper_bound(h_.offset.begin(), h_.offset.end(), pick) - h_.offset.begin()) - 1;
        const LightTerm term = light_term(h_, pick, level, settings_, scale_[level]);
        const Received received = receive_at(term, settings_, at);
        Sample s;
        if (params_.shadow_points == ShadowPoints::jitter) {
            const Random4 r = random4(pixel, static_cast<std::uint32_t>(sample), Stream::jitter, key_);
            s.point = jittered_point(h_, pick, params_.deviation_scale, r);
            s.omega = 1.0f;
        } else {
            const ChosenMember chosen = choose_member(at, pixel, static_cast<std::uint32_t>(sample), pick, received);
            s.member = static_cast<std::int32_t>(chosen.member);
            s.point = h_.position[chosen.member];
            s.omega = chosen.omega;
        }
        switch (params_.shadow_estimator) {
            case ShadowEstimator::average:
                s.share = vec3(1.0f);
                break;
            case ShadowEstimator::ratio_rgb:
                s.share = term.intensity * (received.weight * s.omega * (f > 0 ? sum / f : 0.0f));
                break;
            default:
                s.share = vec3(s.omega);
        }
        return s;
    }

  private:
    const HierarchyView& h_;
    const Params& params_;
    LightSettings settings_;
    std::uint32_t key_;
    std::vector<float> scale_;

    struct ChosenMember {
        std::uint32_t member;
        float omega;
    };

    // One of a few members drawn from the grid light, in proportion to their omegas, and the mean of these: the same
    // expectation as of a single draw (resampling, Talbot et al. 2005), with less noise and fewer rays to members that
    // face away.
    ChosenMember choose_member(const LitPoint& at, std::uint32_t pixel, std::uint32_t sample, std::uint32_t pick,
                               const Received& grid_light) const {
        ChosenMember chosen{pick, 1.0f};
        if (pick < h_.input_index.size()) return chosen;
        // The average is over members as they are, whatever their omegas.
        const bool plain = params_.shadow_estimator == ShadowEstimator::average;
        const std::uint32_t count = plain ? 1 : static_cast<std::uint32_t>(params_.member_candidates);
        float sum = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            const Random4 r = random4(pixel, sample * count + i, Stream::member, key_);
            const std::uint32_t member = draw_member(h_, pick, r);
            const float omega = member_weight(member, at, grid_light);
            sum += omega;
            if (i == 0 || to_unit(r.z) * sum < omega) chosen.member = member;
        }
        chosen.omega = sum / static_cast<float>(count);
        return chosen;
    }

    // omega: the member's cosines over the grid light's. Members that face away don't count; distance is left
    // out on purpose, a near member would spike.
    float member_weight(std::uint32_t member, const LitPoint& at, const Received& grid_light) const {
        const float whole = grid_light.cosine * grid_light.emission;
        if (!(whole > 0)) return 0.0f;
        const vec3 to = h_.position[member] - at.position;
        const float inverse = 1.0f / std::sqrt(larger(glm::dot(to, to), std::numeric_limits<float>::min()));
        const float cosine = larger(0.0f, glm::dot(at.normal, to) * inverse);
        // A single light has one normal, for which every lobe is the plain cosine, or none.
        const float emitted =
            h_.oriented[member] ? larger(0.0f, -glm::dot(h_.normal[member], to) * inverse) : isotropic_emission;
        return smaller(params_.omega_max, cosine * emitted / whole);
    }
};

void light_directly(const Scene& scene, const GBufferView& g, const Params& params, int y, RayBatch& rays,
                    ShadowData& out) {
    const SceneData& data = scene.data();
    const std::uint32_t key = frame_key(params.seed, params.frame);
    const auto for_row = [&](const auto& visit) {
        for (int x = 0; x < g.width; ++x) {
            const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
            if (g.depth[p] > 0) visit(p, LitPoint{g.position[p], g.normal[p], g.geometric_normal[p]});
        }
    };
    const auto one_ray_each = [&](const auto& lights, const auto& candidate_from) {
        for (const auto& light : lights) {
            for_row([&](std::size_t p, const LitPoint& at) {
                const DirectCandidate c = candidate_from(scene, light, at);
                if (c.irradiance != vec3(0.0f)) rays.push(c.ray, p, c.irradiance);
            });
            rays.gather(scene, Coherence::coherent, out.direct);
        }
    };
    one_ray_each(data.suns, from_sun);
    one_ray_each(data.points, from_point);
    one_ray_each(data.spots, from_spot);
    if (scene.emitters().empty() || params.direct_samples == 0) return;
    const float share = 1.0f / static_cast<float>(params.direct_samples);
    for_row([&](std::size_t p, const LitPoint& at) {
        for (int s = 0; s < params.direct_samples; ++s) {
            const Random4 r = random4(static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(s), Stream::area, key);
            const DirectCandidate c = from_emitters(scene, at, r);
            if (c.irradiance != vec3(0.0f)) rays.push(c.ray, p, c.irradiance * share);
        }
    });
    rays.gather(scene, Coherence::incoherent, out.area);
}

void trace_samples(const Scene& scene, const GBufferView& g, const LightingView& lighting, const Params& params,
                   const Sampler& sampler, int y, RayBatch& rays, ShadowData& out) {
    const int k = params.shadow_samples, channels = out.channels;
    // S ignores rays whose share is zero; the average counts every one.
    const bool trace_all = params.shadow_estimator == ShadowEstimator::average;
    const float mean = 1.0f / static_cast<float>(std::max(1, k));
    for (int x = 0; x < g.width; ++x) {
        const std::size_t p = static_cast<std::size_t>(y) * g.width + x;
        const LitPoint at{g.position[p], g.normal[p], g.geometric_normal[p]};
        bool any = false;
        vec3 weight(0.0f);
        for (int s = 0; s < k; ++s) {
            const std::size_t slot = p * k + s;
            if (lighting.light[slot] < 0) continue;
            any = true;
            const Sample sample =
                sampler.draw(at, static_cast<std::uint32_t>(p), s, static_cast<std::uint32_t>(lighting.light[slot]),
                             lighting.target_weight[slot], lighting.weight_sum[p]);
            out.point[slot] = sample.point;
            out.member[slot] = sample.member;
            out.omega[slot] = sample.omega;
            weight += sample.share * mean;
            if (trace_all || sample.omega > 0)
                rays.push(shadow_ray(scene, at, sample.point), slot, sample.share * mean);
        }
        // The corrected estimator does not divide by U: S is relative to 1 wherever something was picked.
        if (params.shadow_estimator == ShadowEstimator::corrected && any) weight = vec3(1.0f);
        for (int c = 0; c < channels; ++c) out.weight[p * channels + c] = weight[c];
    }
    rays.trace(scene, Coherence::incoherent, [&](std::size_t slot, const vec3& share, bool free) {
        out.visible[slot] = free;
        if (!free) return;
        for (int c = 0; c < channels; ++c) out.shadowed[slot / k * channels + c] += share[c];
    });
}

// Mean irradiance of a few short paths a pixel.
std::vector<vec3> compensate(const Scene& scene, const GBufferView& g, const Params& params) {
    const auto count = static_cast<std::uint32_t>(params.compensation_samples);
    const SampleSums sums = trace_compensation(scene, g, {params.frame * count, count}, params);
    std::vector<vec3> mean(g.pixels());
    for (std::size_t p = 0; p < mean.size(); ++p) mean[p] = vec3(sums.sum[p] / static_cast<double>(count));
    return mean;
}

}  // namespace

ShadowData trace_shadow_rays(const Scene& scene, const HierarchyView& h, const GBufferView& g,
                             const LightingView& lighting, const Params& params) {
    const std::size_t pixels = g.pixels(), slots = pixels * params.shadow_samples;
    ShadowData out;
    out.channels = params.shadow_estimator == ShadowEstimator::ratio_rgb ? 3 : 1;
    out.point.assign(slots, vec3(0.0f));
    out.member.assign(slots, -1);
    out.omega.assign(slots, 0.0f);
    out.visible.assign(slots, 0);
    out.shadowed.assign(pixels * out.channels, 0.0f);
    out.weight.assign(pixels * out.channels, 0.0f);
    out.direct.assign(pixels, vec3(0.0f));
    out.area.assign(pixels, vec3(0.0f));
    const Sampler sampler(h, params, scene.radius());
#pragma omp parallel
    {
        RayBatch rays;
#pragma omp for schedule(dynamic)
        for (int y = 0; y < g.height; ++y) {
            if (params.shadow_samples > 0) trace_samples(scene, g, lighting, params, sampler, y, rays, out);
            light_directly(scene, g, params, y, rays, out);
        }
    }
    if (params.compensation == Compensation::path) out.left_out = compensate(scene, g, params);
    return out;
}

}  // namespace lab
