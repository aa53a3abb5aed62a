#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/shadow_samples.cpp"
#include <hwy/foreach_target.h>

#include "lab/jitter.h"
#include "lab/light.h"
#include "lab/random.h"
#include "lab/select.h"
#include "lab/shadow_samples.h"
#include "lab/side_by_side.h"

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

constexpr int capacity = SampleChunk::capacity;

// The grid lights' part of omega: receiver's cosine times the lobe's emission. Column k begins at k * capacity.
void grid_light_parts(const float* at, const float* light, int count, float* whole) {
    const auto column = [](const float* columns, int k) { return columns + static_cast<std::size_t>(k) * capacity; };
    const float *lx = light, *ly = column(light, 1), *lz = column(light, 2);
    const float *px = at, *py = column(at, 1), *pz = column(at, 2);
    const float *nx = column(at, 4), *ny = column(at, 5), *nz = column(at, 6);
    const float *mx = column(light, 3), *my = column(light, 4), *mz = column(light, 5);
    const float *xx = column(light, 6), *yy = column(light, 7), *zz = column(light, 8);
    const float *xy = column(light, 9), *xz = column(light, 10), *yz = column(light, 11), *constant = column(light, 12);
#pragma omp simd
    for (int i = 0; i < count; ++i) {
        const float vx = lx[i] - px[i], vy = ly[i] - py[i], vz = lz[i] - pz[i];
        const float d2 = vx * vx + vy * vy + vz * vz;
        const float inverse = 1.0f / std::sqrt(larger(d2, std::numeric_limits<float>::min()));
        const float cosine = larger(0.0f, (nx[i] * vx + ny[i] * vy + nz[i] * vz) * inverse);
        // emission(), without its struct, which GCC does not take apart in a loop.
        const float square = vx * (xx[i] * vx + 2.0f * (xy[i] * vy + xz[i] * vz)) +
                             vy * (yy[i] * vy + 2.0f * yz[i] * vz) + vz * (zz[i] * vz);
        const float along = -(mx[i] * vx + my[i] * vy + mz[i] * vz);
        const float root = std::sqrt(larger(0.0f, square));
        whole[i] = cosine * (larger(0.0f, (along + root) * inverse) + constant[i]);
    }
}

struct RandomColumns {
    std::uint32_t x[capacity], y[capacity], z[capacity];
};

// The next numbers of all sequences.
void advance(RandomColumns& random, int count) {
#pragma omp simd
    for (int j = 0; j < count; ++j) random.x[j] = pcg(random.y[j]);
}

// Members of many lights at a time: each is drawn from a finer level, down to S1 and then to S0. The memory that a step
// will read is asked for while the others' addresses are found, so that nobody waits for it alone. Picks next to each
// other are of one level, mostly, and arrive together: those that have arrived go along unchanged.
void draw_members(const HierarchyView& h, const MemberRow* rows, RandomColumns& random, int count,
                  std::uint32_t* light) {
    const auto inputs = static_cast<std::uint32_t>(h.input_index.size());
    const std::int64_t* offset = h.members.offset.data();
    const AliasSlot* slots = h.members.slot.data();
    const AliasSlot* slot[capacity];
    std::uint32_t rest[capacity];
    const auto ask_for = [&](std::uint32_t next) {
        const void* row = next < inputs ? static_cast<const void*>(rows + next) : offset + (next - inputs);
        hwy::Prefetch(static_cast<const char*>(row));
    };
    std::uint32_t coarsest = 0;
    for (int j = 0; j < count; ++j) {
        ask_for(light[j]);
        coarsest = light[j] > coarsest ? light[j] : coarsest;
    }
    while (coarsest >= inputs) {
        for (int j = 0; j < count; ++j) {
            const std::size_t row = light[j] < inputs ? 0 : light[j] - inputs;
            const std::int64_t first = offset[row];
            const AliasChoice choice = alias_choice(static_cast<std::uint64_t>(offset[row + 1] - first), random.x[j]);
            slot[j] = slots + first + choice.slot;
            rest[j] = choice.rest;
            hwy::Prefetch(slot[j]);
            hwy::Prefetch(&slot[j]->keep);  // may lie in the next line
        }
        advance(random, count);
        coarsest = 0;
        for (int j = 0; j < count; ++j) {
            const std::uint32_t chosen = alias_item(*slot[j], rest[j]);
            light[j] = light[j] < inputs ? light[j] : chosen;
            ask_for(light[j]);
            coarsest = light[j] > coarsest ? light[j] : coarsest;
        }
    }
}

LAB_INLINE std::uint32_t spread(std::uint32_t x) {
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

// Where rays end, along a curve that fills the scene's cube.
void places(const SampleBox& box, int count, SampleChunk& chunk) {
    constexpr float last = (1 << SampleChunk::place_bits) - 1;
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const float x = larger(0.0f, smaller(last, (chunk.x[j] - box.low.x) * box.scale));
        const float y = larger(0.0f, smaller(last, (chunk.y[j] - box.low.y) * box.scale));
        const float z = larger(0.0f, smaller(last, (chunk.z[j] - box.low.z) * box.scale));
        const auto cx = static_cast<std::uint32_t>(static_cast<std::int32_t>(x));
        const auto cy = static_cast<std::uint32_t>(static_cast<std::int32_t>(y));
        const auto cz = static_cast<std::uint32_t>(static_cast<std::int32_t>(z));
        chunk.place[j] = spread(cx) | spread(cy) << 1 | spread(cz) << 2;
    }
}

void hash(const std::uint32_t* pixel, const std::uint32_t* sample, std::uint32_t candidates, std::uint32_t i,
          std::uint32_t key, int count, RandomColumns& out) {
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const Random4 r = random4(pixel[j], sample[j] * candidates + i, Stream::member, key);
        out.x[j] = r.x;
        out.y[j] = r.y;
        out.z[j] = r.z;
    }
}

// omega of one candidate: the member's cosines over the grid light's. Members that face away don't count; distance is
// left out on purpose, a near member would spike. The candidate replaces the one before in proportion to its omega.
void weigh(const float (*at)[capacity], const float (*member)[capacity], const float* whole, const std::uint32_t* bits,
           const std::int32_t* candidate, float omega_max, bool first, int count, SampleChunk& chunk) {
#pragma omp simd
    for (int j = 0; j < count; ++j) {
        const float tx = member[0][j] - at[0][j], ty = member[1][j] - at[1][j], tz = member[2][j] - at[2][j];
        const float d2 = tx * tx + ty * ty + tz * tz;
        const float inverse = 1.0f / std::sqrt(larger(d2, std::numeric_limits<float>::min()));
        const float cosine = larger(0.0f, (at[4][j] * tx + at[5][j] * ty + at[6][j] * tz) * inverse);
        // A single light has one normal, for which every lobe is the plain cosine, or none.
        const float facing = member[4][j] * tx + member[5][j] * ty + member[6][j] * tz;
        const float emitted = larger(0.0f, -facing * inverse) + member[3][j];
        const float ratio = smaller(omega_max, cosine * emitted / whole[j]);
        const float omega = whole[j] > 0.0f ? ratio : 0.0f;
        const float sum = (first ? 0.0f : chunk.omega[j]) + omega;
        const bool take = first | (to_unit(bits[j]) * sum < omega);
        chunk.omega[j] = sum;
        chunk.member[j] = take ? candidate[j] : chunk.member[j];
        chunk.x[j] = take ? member[0][j] : chunk.x[j];
        chunk.y[j] = take ? member[1][j] : chunk.y[j];
        chunk.z[j] = take ? member[2][j] : chunk.z[j];
    }
}

// One of a few members drawn from the grid light, in proportion to their omegas, and the mean of these: the same
// expectation as of a single draw (resampling, Talbot et al. 2005), with less noise and fewer rays to members that
// face away.
void DrawMembers(const Sampler& sampler, const std::vector<LitPixel>& receivers, SampleChunk& chunk) {
    const HierarchyView& h = sampler.hierarchy();
    const Params& params = sampler.params();
    const auto inputs = static_cast<std::uint32_t>(h.input_index.size());
    const int count = (chunk.count + 15) / 16 * 16;  // whole vectors: the first sample fills up
    float at[8][capacity], light[16][capacity], member[8][capacity];
    float whole[capacity];
    std::uint32_t pixel[capacity], row[capacity];
    std::int32_t candidate[capacity];
    for (int j = 0; j < count; ++j) {
        if (j >= chunk.count) {
            chunk.receiver[j] = chunk.receiver[0];
            chunk.sample[j] = chunk.sample[0];
            chunk.light[j] = chunk.light[0];
        }
        pixel[j] = receivers[chunk.receiver[j]].pixel;
        row[j] = chunk.light[j] < inputs ? 0 : chunk.light[j] - inputs;
    }
    side_by_side<2>(receivers.data(), chunk.receiver, count, at);
    if (params.receiver == Receiver::soft) {
        for (int j = 0; j < count; ++j) {
            const Received r = sampler.receive_at(chunk.light[j], receivers[chunk.receiver[j]]);
            whole[j] = r.cosine * r.emission;
        }
    } else {
        side_by_side<4>(sampler.grid_lights().data(), row, count, light);
        grid_light_parts(at[0], light[0], count, whole);
    }
    // The average is over members as they are, whatever their omegas.
    const bool plain = params.shadow_estimator == ShadowEstimator::average;
    const std::uint32_t candidates = plain ? 1 : static_cast<std::uint32_t>(params.member_candidates);
    for (std::uint32_t i = 0; i < candidates; ++i) {
        RandomColumns random;
        hash(pixel, chunk.sample, candidates, i, sampler.key(), count, random);
        std::copy_n(chunk.light, count, row);
        draw_members(h, sampler.members().data(), random, count, row);
        for (int j = 0; j < count; ++j) candidate[j] = static_cast<std::int32_t>(row[j]);
        side_by_side<2>(sampler.members().data(), row, count, member);
        weigh(at, member, whole, random.z, candidate, params.omega_max, i == 0, count, chunk);
    }
    const float share = 1.0f / static_cast<float>(candidates);
#pragma omp simd
    for (int j = 0; j < count; ++j) chunk.omega[j] = chunk.light[j] < inputs ? 1.0f : chunk.omega[j] * share;
}

void FindPlaces(const SampleBox& box, SampleChunk& chunk) {
    places(box, chunk.count, chunk);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(DrawMembers);
HWY_EXPORT(FindPlaces);

Sampler::Sampler(const HierarchyView& hierarchy, const Params& params, const Scene& scene)
    : h_(hierarchy),
      params_(params),
      settings_(params, scene.radius()),
      key_(frame_key(params.seed, params.frame)),
      box_{scene.centre() - scene.radius(), (1 << SampleChunk::place_bits) / (2 * scene.radius())} {
    for (int level = 0; level <= h_.top(); ++level) scale_.push_back(deal_scale(h_, level, params));
    if (params.shadow_points != ShadowPoints::members || params.shadow_samples == 0) return;
    const auto inputs = static_cast<std::int64_t>(h_.input_index.size());
    const auto lights = static_cast<std::int64_t>(h_.position.size());
    members_.resize(inputs);
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

Received Sampler::receive_at(std::uint32_t pick, const LitPixel& at) const {
    return with_kinds(settings_, [&]<bool soft, bool clamped>() {
        return receive<soft, clamped>(term(pick), settings_.clamp2, at.position.x, at.position.y, at.position.z,
                                      at.normal.x, at.normal.y, at.normal.z);
    });
}

vec3 Sampler::share_rgb(const LitPixel& at, std::uint32_t pick, float omega, float f, float sum) const {
    return term(pick).intensity * (receive_at(pick, at).weight * omega * (f > 0 ? sum / f : 0.0f));
}

void Sampler::jitter(const std::vector<LitPixel>& receivers, SampleChunk& chunk) const {
    for (int j = 0; j < chunk.count; ++j) {
        const Random4 r = random4(receivers[chunk.receiver[j]].pixel, chunk.sample[j], Stream::jitter, key_);
        const vec3 point = jittered_point(h_, chunk.light[j], params_.deviation_scale, r);
        chunk.x[j] = point.x;
        chunk.y[j] = point.y;
        chunk.z[j] = point.z;
        chunk.omega[j] = 1.0f;
        chunk.member[j] = -1;
    }
}

void Sampler::draw(const std::vector<LitPixel>& receivers, SampleChunk& chunk) const {
    if (chunk.count == 0) return;
    if (params_.shadow_points == ShadowPoints::jitter)
        jitter(receivers, chunk);
    else
        HWY_DYNAMIC_DISPATCH(DrawMembers)(*this, receivers, chunk);
    HWY_DYNAMIC_DISPATCH(FindPlaces)(box_, chunk);
}

}  // namespace lab
#endif
