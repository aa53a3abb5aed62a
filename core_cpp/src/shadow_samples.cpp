#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/shadow_samples.cpp"
#include <hwy/foreach_target.h>

#include "lab/jitter.h"
#include "lab/light.h"
#include "lab/member_lanes.h"
#include "lab/random.h"
#include "lab/select.h"
#include "lab/shadow_samples.h"
#include "lab/side_by_side.h"
#include "lab/stream_copy.h"

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

struct Receivers {
    Column x, y, z, nx, ny, nz;
    Bits pixel, sample;
};

// `count` samples, each pixel's side by side.
void load_receivers(const GBufferView& g, std::size_t first, int pixels, int samples, Receivers& at) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::Full128<float> d;
    const hn::Full128<std::uint32_t> du;
    for (int i = 0; i < pixels; ++i) {
        const vec3 &position = g.position[first + i], &normal = g.normal[first + i];
        const auto pixel = hn::Set(du, static_cast<std::uint32_t>(first + i));
        const auto x = hn::Set(d, position.x), y = hn::Set(d, position.y), z = hn::Set(d, position.z);
        const auto nx = hn::Set(d, normal.x), ny = hn::Set(d, normal.y), nz = hn::Set(d, normal.z);
        for (int s = 0; s < samples; s += 4) {
            const int j = i * samples + s;
            hn::StoreU(x, d, at.x + j);
            hn::StoreU(y, d, at.y + j);
            hn::StoreU(z, d, at.z + j);
            hn::StoreU(nx, d, at.nx + j);
            hn::StoreU(ny, d, at.ny + j);
            hn::StoreU(nz, d, at.nz + j);
            hn::StoreU(pixel, du, at.pixel + j);
            hn::StoreU(hn::Iota(du, static_cast<std::uint32_t>(s)), du, at.sample + j);
        }
    }
}

// The grid lights' part of omega: receiver's cosine times the lobe's emission.
void grid_light_parts(const Receivers& at, const float* light, int count, float* whole) {
    const auto column = [](const float* columns, int k) { return columns + static_cast<std::size_t>(k) * width; };
    const float *lx = light, *ly = column(light, 1), *lz = column(light, 2);
    const float *mx = column(light, 3), *my = column(light, 4), *mz = column(light, 5);
    const float *xx = column(light, 6), *yy = column(light, 7), *zz = column(light, 8);
    const float *xy = column(light, 9), *xz = column(light, 10), *yz = column(light, 11), *constant = column(light, 12);
#pragma omp simd
    for (int i = 0; i < count; ++i) {
        const float vx = lx[i] - at.x[i], vy = ly[i] - at.y[i], vz = lz[i] - at.z[i];
        const float d2 = vx * vx + vy * vy + vz * vz;
        const float inverse = 1.0f / std::sqrt(larger(d2, std::numeric_limits<float>::min()));
        const float cosine = larger(0.0f, (at.nx[i] * vx + at.ny[i] * vy + at.nz[i] * vz) * inverse);
        // emission(), without its struct, which GCC does not take apart in a loop (mixed terms are doubled already).
        const float square =
            vx * (xx[i] * vx + xy[i] * vy + xz[i] * vz) + vy * (yy[i] * vy + yz[i] * vz) + vz * (zz[i] * vz);
        const float along = -(mx[i] * vx + my[i] * vy + mz[i] * vz);
        const float root = std::sqrt(larger(0.0f, square));
        whole[i] = cosine * (larger(0.0f, (along + root) * inverse) + constant[i]);
    }
}

// Candidate i of each sample: what is drawn, and the bits that decide about it.
struct Candidates {
    Bits member, bits;
};

void draw_candidates(const Sampler& sampler, const Receivers& at, const std::uint32_t* light, std::uint32_t candidates,
                     std::uint32_t i, int count, Candidates& out) {
    const std::uint32_t key = sampler.key();
    const std::uint32_t *pixel = at.pixel, *sample = at.sample;
    std::copy_n(light, count, out.member);
    Walk walk(sampler, count, out.member);
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const Random4 r = random4(pixel[j], sample[j] * candidates + i, Stream::member, key);
        walk.random[j] = r.x;
        walk.state[j] = r.y;
        out.bits[j] = r.z;
    }
    draw_members(walk);
}

// The candidate that leads so far, and the sum of the omegas.
struct Chosen {
    Column x, y, z, omega;
    Bits member;
};

// omega of one candidate: the member's cosines over the grid light's. Members that face away don't count; distance is
// left out on purpose, a near member would spike. The candidate replaces the one before in proportion to its omega.
void weigh(const Receivers& at, const float (*member)[width], const float* whole, const Candidates& candidate,
           float omega_max, bool first, int count, Chosen& chosen) {
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const float tx = member[0][j] - at.x[j], ty = member[1][j] - at.y[j], tz = member[2][j] - at.z[j];
        const float d2 = tx * tx + ty * ty + tz * tz;
        const float inverse = 1.0f / std::sqrt(larger(d2, std::numeric_limits<float>::min()));
        const float cosine = larger(0.0f, (at.nx[j] * tx + at.ny[j] * ty + at.nz[j] * tz) * inverse);
        // A single light has one normal, for which every lobe is the plain cosine, or none.
        const float facing = member[4][j] * tx + member[5][j] * ty + member[6][j] * tz;
        const float emitted = larger(0.0f, -facing * inverse) + member[3][j];
        const float ratio = smaller(omega_max, cosine * emitted / whole[j]);
        const float omega = whole[j] > 0.0f ? ratio : 0.0f;
        const float sum = (first ? 0.0f : chosen.omega[j]) + omega;
        const bool take = first | (to_unit(candidate.bits[j]) * sum < omega);
        chosen.omega[j] = sum;
        chosen.member[j] = take ? candidate.member[j] : chosen.member[j];
        chosen.x[j] = take ? member[0][j] : chosen.x[j];
        chosen.y[j] = take ? member[1][j] : chosen.y[j];
        chosen.z[j] = take ? member[2][j] : chosen.z[j];
    }
}

void grid_lights(const Sampler& sampler, const Receivers& at, const std::uint32_t* light, std::uint32_t inputs,
                 int count, float* whole) {
    if (sampler.params().receiver == Receiver::soft) {
        for (int j = 0; j < count; ++j) {
            const Received r = sampler.receive_at(light[j], at.pixel[j]);
            whole[j] = r.cosine * r.emission;
        }
        return;
    }
    Bits row;
    float columns[16][width];
    for (int j = 0; j < count; ++j) row[j] = light[j] < inputs ? 0 : light[j] - inputs;
    side_by_side<4>(sampler.grid_lights().data(), row, count, columns);
    grid_light_parts(at, columns[0], count, whole);
}

// Samples without a light have no point.
void store(Chosen& chosen, const std::int32_t* picked, std::size_t slot, int count, ShadowData& out) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::Full128<float> d;
    const hn::Full128<std::int32_t> di;
    const hn::Full128<std::uint32_t> du;
    float point[3 * width];
    for (int j = 0; j < count; j += 4) {
        const auto any = hn::RebindMask(d, hn::Gt(hn::LoadU(di, picked + j), hn::Set(di, -1)));
        const auto of = [&](const float* column) { return hn::IfThenElseZero(any, hn::LoadU(d, column + j)); };
        hn::StoreInterleaved3(of(chosen.x), of(chosen.y), of(chosen.z), d, point + 3 * j);
        hn::StoreU(of(chosen.omega), d, chosen.omega + j);
        const auto none = hn::Set(du, ~0u);
        hn::StoreU(hn::IfThenElse(hn::RebindMask(du, any), hn::LoadU(du, chosen.member + j), none), du,
                   chosen.member + j);
    }
    stream_copy(&out.point[slot].x, point, 3 * static_cast<std::size_t>(count));
    stream_copy(&out.omega[slot], chosen.omega, static_cast<std::size_t>(count));
    stream_copy(reinterpret_cast<std::uint32_t*>(&out.member[slot]), chosen.member, static_cast<std::size_t>(count));
}

// One of a few members drawn from the grid light, in proportion to their omegas, and the mean of these: the same
// expectation as of a single draw (resampling, Talbot et al. 2005), with less noise and fewer rays to members that
// face away.
void draw_chunk(const Sampler& sampler, std::size_t first, int pixels, ShadowData& out) {
    const Params& params = sampler.params();
    const auto inputs = static_cast<std::uint32_t>(sampler.hierarchy().input_index.size());
    const int k = params.shadow_samples, samples = pixels * k, count = (samples + 15) / 16 * 16;  // whole vectors
    std::int32_t picked[width];
    std::copy_n(&sampler.lighting().light[first * k], samples, picked);
    std::fill_n(picked + samples, count - samples, -1);
    Receivers at;
    load_receivers(sampler.gbuffer(), first, pixels, k, at);
    Bits light;
#pragma omp simd
    for (int j = 0; j < count; ++j) light[j] = picked[j] >= 0 ? static_cast<std::uint32_t>(picked[j]) : 0u;
    for (int j = samples; j < count; ++j) at.pixel[j] = at.pixel[0];
    Column whole;
    grid_lights(sampler, at, light, inputs, count, whole);
    // The average is over members as they are, whatever their omegas.
    const bool plain = params.shadow_estimator == ShadowEstimator::average;
    const std::uint32_t candidates = plain ? 1 : static_cast<std::uint32_t>(params.member_candidates);
    Candidates drawn;
    Chosen chosen;
    float member[8][width];
    for (std::uint32_t i = 0; i < candidates; ++i) {
        draw_candidates(sampler, at, light, candidates, i, count, drawn);
        side_by_side<2>(sampler.members().data(), drawn.member, count, member);
        weigh(at, member, whole, drawn, params.omega_max, i == 0, count, chosen);
    }
    const float share = 1.0f / static_cast<float>(candidates);
#pragma omp simd
    for (int j = 0; j < count; ++j) chosen.omega[j] = light[j] < inputs ? 1.0f : chosen.omega[j] * share;
    store(chosen, picked, first * k, samples, out);
}

void DrawMembers(const Sampler& sampler, std::size_t first, std::size_t count, ShadowData& out) {
    const std::size_t pixels = capacity / sampler.params().shadow_samples;
    for (std::size_t i = 0; i < count; i += pixels)
        draw_chunk(sampler, first + i, static_cast<int>(count - i < pixels ? count - i : pixels), out);
    finish_streams();
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(DrawMembers);

Sampler::Sampler(const HierarchyView& hierarchy, const GBufferView& gbuffer, const LightingView& lighting,
                 const Params& params, const Scene& scene)
    : h_(hierarchy),
      g_(gbuffer),
      lighting_(lighting),
      params_(params),
      settings_(params, scene.radius()),
      key_(frame_key(params.seed, params.frame)) {
    for (int level = 0; level <= h_.top(); ++level) scale_.push_back(deal_scale(h_, level, params));
    if (params.shadow_points != ShadowPoints::members || params.shadow_samples == 0) return;
    const auto inputs = static_cast<std::int64_t>(h_.input_index.size());
    const auto lights = static_cast<std::int64_t>(h_.position.size());
    members_.resize(inputs);
    tables_ = PackedTables(h_.members.slot, h_.members.offset);
    grid_lights_.resize(std::max<std::int64_t>(1, lights - inputs));
#pragma omp parallel for schedule(static)
    for (std::int64_t i = 0; i < lights; ++i) {
        const bool oriented = h_.oriented[i] != 0;
        if (i < inputs)
            members_[i] = {h_.position[i], oriented ? 0.0f : isotropic_emission, oriented ? h_.normal[i] : vec3(0.0f),
                           0.0f};
        else
            grid_lights_[i - inputs] = {
                h_.position[i], make_lobe(params.lobe, h_.normal[i], h_.normal_moment[i], oriented), {0, 0, 0}};
    }
    if (lights == inputs) grid_lights_[0] = {};
}

LightTerm Sampler::term(std::uint32_t pick) const {
    const auto above = std::upper_bound(h_.offset.begin(), h_.offset.end(), static_cast<std::int64_t>(pick));
    const int level = static_cast<int>(above - h_.offset.begin()) - 1;
    return light_term(h_, pick, level, settings_, scale_[level]);
}

Received Sampler::receive_at(std::uint32_t pick, std::size_t pixel) const {
    const vec3 position = g_.position[pixel], normal = g_.normal[pixel];
    return with_kinds(settings_, [&]<bool soft, bool clamped>() {
        return receive<soft, clamped>(term(pick), settings_.clamp2, position.x, position.y, position.z, normal.x,
                                      normal.y, normal.z);
    });
}

vec3 Sampler::share_rgb(std::size_t pixel, std::size_t slot, float omega) const {
    const auto pick = static_cast<std::uint32_t>(lighting_.light[slot]);
    const float f = lighting_.target_weight[slot], sum = lighting_.weight_sum[pixel];
    return term(pick).intensity * (receive_at(pick, pixel).weight * omega * (f > 0 ? sum / f : 0.0f));
}

void Sampler::jitter(std::size_t first, std::size_t count, ShadowData& out) const {
    const int k = params_.shadow_samples;
    for (std::size_t p = first; p < first + count; ++p)
        for (int s = 0; s < k; ++s) {
            const std::size_t slot = p * k + s;
            const std::int32_t light = lighting_.light[slot];
            const Random4 r =
                random4(static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(s), Stream::jitter, key_);
            out.point[slot] = light < 0
                                  ? vec3(0.0f)
                                  : jittered_point(h_, static_cast<std::uint32_t>(light), params_.deviation_scale, r);
            out.omega[slot] = light < 0 ? 0.0f : 1.0f;
            out.member[slot] = -1;
        }
}

void Sampler::draw(std::size_t first, std::size_t count, ShadowData& out) const {
    if (params_.shadow_points == ShadowPoints::jitter)
        jitter(first, count, out);
    else
        HWY_DYNAMIC_DISPATCH(DrawMembers)(*this, first, count, out);
}

}  // namespace lab
#endif
