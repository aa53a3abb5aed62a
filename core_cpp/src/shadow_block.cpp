#include "lab/shadow_block.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>

#include "lab/direct_light.h"

namespace lab {
namespace {

// A sample of the block: row of its pixel and number among the pixel's samples.
static_assert(max_shadow_samples <= 64);
std::uint32_t sample_name(std::uint32_t row, std::uint32_t sample) {
    return row << 6 | sample;
}
std::uint32_t row_of(std::uint32_t name) {
    return name >> 6;
}
std::uint32_t sample_of(std::uint32_t name) {
    return name & 63u;
}

LitPoint lit_point(const GBufferView& g, std::size_t p) {
    return {g.position[p], g.normal[p], g.geometric_normal[p]};
}

// Rays on their way to a packet, which is traced when it is full; what they add goes to `sums` if they are free.
class PacketQueue {
  public:
    PacketQueue(const TracePacket& trace, std::size_t block, Coherence coherence, std::span<vec3> sums)
        : trace_(trace), block_(block), coherence_(coherence), sums_(sums) {}

    void push(const Ray& ray, std::size_t to, const vec3& add) {
        packet_.set(count_, ray.origin, ray.direction, ray.length);
        to_[count_] = to;
        add_[count_] = add;
        if (++count_ == RayPacket::size) flush();
    }

    void flush() {
        if (count_ == 0) return;
        packet_.pad(count_);
        for (std::uint32_t free = trace_(block_, packet_, count_, coherence_); free != 0; free &= free - 1) {
            const int i = std::countr_zero(free);
            sums_[to_[i]] += add_[i];
        }
        count_ = 0;
    }

  private:
    const TracePacket& trace_;
    std::size_t block_;
    Coherence coherence_;
    std::span<vec3> sums_;
    RayPacket packet_;
    std::size_t to_[RayPacket::size];
    vec3 add_[RayPacket::size];
    int count_ = 0;
};

}  // namespace

int ShadowBlock::side(int shadow_samples) {
    constexpr int samples = 1 << 14;
    int side = 128;
    while (side * side * shadow_samples > samples) side /= 2;
    return side;
}

void ShadowBlock::shade(int left, int top, std::size_t block) {
    block_ = block;
    collect(left, top);
    if (params_.shadow_samples > 0) {
        draw_samples();
        trace_samples();
        accumulate();
    }
    light_directly();
}

// The block's pixels by squares of 4 x 4, which direct light traces as packets, and their picks by light: neighbours
// in the list are neighbours in the grid, and what they are made of stays in the cache.
void ShadowBlock::collect(int left, int top) {
    const int k = params_.shadow_samples, channels = out_.channels;
    const int side = ShadowBlock::side(k), right = std::min(g_.width, left + side);
    const int bottom = std::min(g_.height, top + side);
    pixels_.clear();
    picks_.clear();
    for (int y0 = top; y0 < bottom; y0 += 4)
        for (int x0 = left; x0 < right; x0 += 4)
            for (int y = y0; y < std::min(bottom, y0 + 4); ++y)
                for (int x = x0; x < std::min(right, x0 + 4); ++x) {
                    const std::size_t p = static_cast<std::size_t>(y) * g_.width + x;
                    out_.direct[p] = out_.area[p] = vec3(0.0f);
                    const auto row = static_cast<std::uint32_t>(pixels_.size());
                    bool any = g_.depth[p] > 0;
                    for (int s = 0; s < k; ++s) {
                        const std::size_t slot = p * k + s;
                        out_.visible[slot] = 0;
                        if (lighting_.light[slot] < 0) {
                            out_.point[slot] = vec3(0.0f);
                            out_.member[slot] = -1;
                            out_.omega[slot] = 0.0f;
                            continue;
                        }
                        any = true;
                        picks_.push_back(keyed(static_cast<std::uint32_t>(lighting_.light[slot]),
                                               sample_name(row, static_cast<std::uint32_t>(s))));
                    }
                    for (int c = 0; c < channels; ++c)
                        out_.shadowed[p * channels + c] = out_.weight[p * channels + c] = 0.0f;
                    if (!any) continue;
                    const LitPoint at = lit_point(g_, p);
                    pixels_.push_back({at.position, 0.0f, at.normal, 0.0f,
                                       scene_.off_surface(at.position, at.geometric_normal),
                                       static_cast<std::uint32_t>(p)});
                }
}

void ShadowBlock::draw_samples() {
    const auto lights = static_cast<std::uint32_t>(sampler_.hierarchy().position.size());
    // Runs of neighbours are enough: one pass by the leading bits.
    constexpr int digit_bits = 11;
    const int low = std::max(0, static_cast<int>(std::bit_width(lights)) - digit_bits);
    radix_sort<digit_bits>(picks_, spare_, low, digit_bits);
    rays_.clear();
    if (params_.shadow_estimator == ShadowEstimator::ratio_rgb)
        share_rgb_.assign(pixels_.size() * params_.shadow_samples, vec3(0.0f));
    SampleChunk chunk;
    for (const Keyed pick : picks_) {
        chunk.receiver[chunk.count] = row_of(value_of(pick));
        chunk.sample[chunk.count] = sample_of(value_of(pick));
        chunk.light[chunk.count] = key_of(pick);
        if (++chunk.count == SampleChunk::capacity) put(chunk);
    }
    put(chunk);
}

void ShadowBlock::put(SampleChunk& chunk) {
    sampler_.draw(pixels_, chunk);
    // S ignores rays whose share is zero; the average counts every one.
    const bool trace_all = params_.shadow_estimator == ShadowEstimator::average;
    const int k = params_.shadow_samples;
    for (int i = 0; i < chunk.count; ++i) {
        const std::uint32_t row = chunk.receiver[i], s = chunk.sample[i];
        const std::size_t slot = static_cast<std::size_t>(pixels_[row].pixel) * k + s;
        out_.point[slot] = {chunk.x[i], chunk.y[i], chunk.z[i]};
        out_.member[slot] = chunk.member[i];
        out_.omega[slot] = chunk.omega[i];
        if (trace_all || chunk.omega[i] > 0) rays_.push_back(keyed(chunk.place[i], sample_name(row, s)));
        if (!share_rgb_.empty())
            share_rgb_[row * k + s] =
                sampler_.share_rgb(pixels_[row], chunk.light[i], chunk.omega[i], lighting_.target_weight[slot],
                                   lighting_.weight_sum[pixels_[row].pixel]);
    }
    chunk.count = 0;
}

// Rays that end near each other go together: they begin near each other as well, and stay in one part of the tree.
void ShadowBlock::trace_samples() {
    radix_sort<9>(rays_, spare_, 0, 3 * SampleChunk::place_bits);
    RayPacket packet;
    std::size_t slot[RayPacket::size];
    for (std::size_t first = 0; first < rays_.size(); first += RayPacket::size) {
        const int count = static_cast<int>(std::min<std::size_t>(RayPacket::size, rays_.size() - first));
        // While these rays are traced, the next ones' ends come nearer.
        const std::size_t next = std::min(first + 2 * RayPacket::size, rays_.size());
        for (std::size_t i = first + count; i < next; ++i) {
            const LitPixel& at = pixels_[row_of(value_of(rays_[i]))];
            hwy::Prefetch(&at.origin);
            hwy::Prefetch(&out_.point[static_cast<std::size_t>(at.pixel) * params_.shadow_samples +
                                      sample_of(value_of(rays_[i]))]);
        }
        for (int i = 0; i < count; ++i) {
            const std::uint32_t name = value_of(rays_[first + i]);
            const LitPixel& at = pixels_[row_of(name)];
            slot[i] = static_cast<std::size_t>(at.pixel) * params_.shadow_samples + sample_of(name);
            packet.set(i, at.origin, out_.point[slot[i]] - at.origin, shadow_ray_length);
        }
        packet.pad(count);
        const std::uint32_t free = trace_(block_, packet, count, Coherence::incoherent);
        for (int i = 0; i < count; ++i) out_.visible[slot[i]] = (free >> i) & 1u;
    }
}

// Sums over a pixel's samples in their own order, whatever the order they were traced in.
void ShadowBlock::accumulate() {
    const int k = params_.shadow_samples, channels = out_.channels;
    const ShadowEstimator estimator = params_.shadow_estimator;
    const float mean = 1.0f / static_cast<float>(k);
    for (std::size_t row = 0; row < pixels_.size(); ++row) {
        const std::size_t p = pixels_[row].pixel;
        vec3 weight(0.0f), shadowed(0.0f);
        bool any = false;
        for (int s = 0; s < k; ++s) {
            const std::size_t slot = p * k + s;
            if (lighting_.light[slot] < 0) continue;
            any = true;
            const vec3 share = estimator == ShadowEstimator::ratio_rgb ? share_rgb_[row * k + s]
                               : estimator == ShadowEstimator::average ? vec3(1.0f)
                                                                       : vec3(out_.omega[slot]);
            weight += share * mean;
            if (out_.visible[slot]) shadowed += share * mean;
        }
        // The corrected estimator does not divide by U: S is relative to 1 wherever something was picked.
        if (estimator == ShadowEstimator::corrected && any) weight = vec3(1.0f);
        for (int c = 0; c < channels; ++c) {
            out_.weight[p * channels + c] = weight[c];
            out_.shadowed[p * channels + c] = shadowed[c];
        }
    }
}

template <class Candidate>
void ShadowBlock::one_ray_each(const Candidate& candidate) {
    PacketQueue queue(trace_, block_, Coherence::coherent, out_.direct);
    for (const LitPixel& at : pixels_) {
        if (!(g_.depth[at.pixel] > 0)) continue;
        const DirectCandidate c = candidate(lit_point(g_, at.pixel));
        if (c.irradiance != vec3(0.0f)) queue.push(c.ray, at.pixel, c.irradiance);
    }
    queue.flush();
}

void ShadowBlock::light_directly() {
    const SceneData& data = scene_.data();
    for (const SunLight& sun : data.suns) one_ray_each([&](const LitPoint& at) { return from_sun(scene_, sun, at); });
    for (const PointLight& light : data.points)
        one_ray_each([&](const LitPoint& at) { return from_point(scene_, light, at); });
    for (const SpotLight& spot : data.spots)
        one_ray_each([&](const LitPoint& at) { return from_spot(scene_, spot, at); });
    if (scene_.emitters().empty() || params_.direct_samples == 0) return;
    const float share = 1.0f / static_cast<float>(params_.direct_samples);
    PacketQueue queue(trace_, block_, Coherence::incoherent, out_.area);
    for (const LitPixel& at : pixels_) {
        if (!(g_.depth[at.pixel] > 0)) continue;
        const LitPoint point = lit_point(g_, at.pixel);
        for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(params_.direct_samples); ++s) {
            const Random4 r = random4(at.pixel, s, Stream::area, sampler_.key());
            const DirectCandidate c = from_emitters(scene_, point, r);
            if (c.irradiance != vec3(0.0f)) queue.push(c.ray, at.pixel, c.irradiance * share);
        }
    }
    queue.flush();
}

}  // namespace lab
