#include "lab/shadow_block.h"

#include <algorithm>
#include <bit>

#include "lab/direct_light.h"
#include "lab/stream_copy.h"

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
    const int side = ShadowBlock::side(params_.shadow_samples);
    block_ = block;
    left_ = left;
    top_ = top;
    right_ = std::min(g_.width, left + side);
    bottom_ = std::min(g_.height, top + side);
    find_origins();
    if (params_.shadow_samples > 0) {
        collect_rays();
        trace_samples();
    }
    accumulate();
    light_directly();
    store_direct();
}

void ShadowBlock::find_origins() {
    origins_.resize(static_cast<std::size_t>(across()) * (bottom_ - top_));
    RayRow* origin = origins_.data();
    for (int y = top_; y < bottom_; ++y)
        for (std::size_t p = pixel(left_, y); p < pixel(right_, y); ++p)
            *origin++ = {scene_.off_surface(g_.position[p], g_.geometric_normal[p])};
}

// The samples' rays, by where they end.
void ShadowBlock::collect_rays() {
    const int k = params_.shadow_samples, samples = across() * k;
    // S ignores rays whose share is zero; the average counts every one.
    const bool trace_all = params_.shadow_estimator == ShadowEstimator::average;
    directions_.resize(origins_.size() * k);
    rays_.resize(directions_.size());
    place_.resize(samples);
    RayRow* direction = directions_.data();
    Keyed* ray = rays_.data();
    std::uint32_t row = 0;
    for (int y = top_; y < bottom_; ++y) {
        const std::size_t first = pixel(left_, y) * k;
        const vec3* point = &out_.point[first];
        order_.places({point, static_cast<std::size_t>(samples)}, place_.data());
        const std::int32_t* light = &lighting_.light[first];
        const float* omega = &out_.omega[first];
        const std::uint32_t* place = place_.data();
        for (int x = left_; x < right_; ++x, ++row) {
            const vec3 origin = origins_[row].of;
            for (int s = 0; s < k; ++s, ++light, ++omega) {
                *direction++ = {*point++ - origin};
                *ray = keyed(*place++, sample_name(row, static_cast<std::uint32_t>(s)));
                ray += trace_all ? *light >= 0 : *omega > 0;
            }
        }
    }
    rays_.resize(static_cast<std::size_t>(ray - rays_.data()));
}

// Rays that end near each other go together: they begin near each other as well, and stay in one part of the tree.
void ShadowBlock::trace_samples() {
    const auto k = static_cast<std::uint32_t>(params_.shadow_samples);
    radix_sort<RayOrder::bits / 2>(rays_, spare_, 0, RayOrder::bits);
    free_.assign(directions_.size(), 0);
    RayPacket packet;
    std::uint32_t row[RayPacket::size], sample[RayPacket::size];
    for (std::size_t first = 0; first < rays_.size(); first += RayPacket::size) {
        const std::size_t last = rays_.size() - 1;
        const int count = static_cast<int>(std::min<std::size_t>(RayPacket::size, rays_.size() - first));
        for (int i = 0; i < RayPacket::size; ++i) {
            const std::uint32_t name = value_of(rays_[std::min(first + i, last)]);
            row[i] = row_of(name);
            sample[i] = row[i] * k + sample_of(name);
            packet.length[i] = shadow_ray_length;
        }
        fill_packet(origins_.data(), row, directions_.data(), sample, packet);
        const std::uint32_t free = trace_(block_, packet, count, Coherence::incoherent);
        for (int i = 0; i < count; ++i) free_[sample[i]] = (free >> i) & 1u;
    }
}

// Sums over a pixel's samples in their own order, whatever the order they were traced in.
void ShadowBlock::accumulate() {
    const int k = params_.shadow_samples, channels = out_.channels;
    const ShadowEstimator estimator = params_.shadow_estimator;
    const bool rgb = estimator == ShadowEstimator::ratio_rgb, average = estimator == ShadowEstimator::average;
    // The corrected estimator does not divide by U: S is relative to 1 wherever something was picked.
    const bool corrected = estimator == ShadowEstimator::corrected;
    const float mean = 1.0f / static_cast<float>(k);
    const std::uint8_t* free = free_.data();
    for (int y = top_; y < bottom_; ++y) {
        const std::size_t first = pixel(left_, y), end = pixel(right_, y);
        if (k > 0) std::copy_n(free, across() * k, &out_.visible[first * k]);
        const std::int32_t* light = lighting_.light.data() + first * k;
        const float* omega = out_.omega.data() + first * k;
        for (std::size_t p = first; p < end; ++p, free += k, light += k, omega += k) {
            vec3 weight(0.0f), shadowed(0.0f);
            bool any = false;
            for (int s = 0; s < k; ++s) {  // without branches where it can be: nobody can foretell their way
                const bool picked = light[s] >= 0;
                any |= picked;
                if (rgb) {
                    if (!picked) continue;
                    const vec3 share = sampler_.share_rgb(p, p * k + s, omega[s]) * mean;
                    weight += share;
                    if (free[s] != 0) shadowed += share;
                } else {
                    const float share = (average ? (picked ? 1.0f : 0.0f) : omega[s]) * mean;
                    weight.x += share;
                    shadowed.x += free[s] != 0 ? share : 0.0f;
                }
            }
            if (corrected && any) weight.x = 1.0f;
            for (int c = 0; c < channels; ++c) {
                out_.weight[p * channels + c] = weight[c];
                out_.shadowed[p * channels + c] = shadowed[c];
            }
        }
    }
}

// The block's pixels that show a surface, by squares of 4 x 4, which direct light traces as packets.
template <class Visit>
void ShadowBlock::for_seen(const Visit& visit) const {
    for (int y0 = top_; y0 < bottom_; y0 += 4)
        for (int x0 = left_; x0 < right_; x0 += 4)
            for (int y = y0; y < std::min(bottom_, y0 + 4); ++y)
                for (int x = x0; x < std::min(right_, x0 + 4); ++x)
                    if (const std::size_t p = pixel(x, y); g_.depth[p] > 0) visit(p, row(x, y));
}

template <class Candidate>
void ShadowBlock::one_ray_each(const Candidate& candidate) {
    PacketQueue queue(trace_, block_, Coherence::coherent, direct_);
    for_seen([&](std::size_t p, std::uint32_t row) {
        const DirectCandidate c = candidate(p, row);
        if (c.irradiance != vec3(0.0f)) queue.push(c.ray, row, c.irradiance);
    });
    queue.flush();
}

void ShadowBlock::light_directly() {
    direct_.assign(origins_.size(), vec3(0.0f));
    area_.assign(origins_.size(), vec3(0.0f));
    const SceneData& data = scene_.data();
    for (const SunLight& sun : data.suns)
        one_ray_each([&](std::size_t p, std::uint32_t row) { return from_sun(sun, g_.normal[p], origins_[row].of); });
    for (const PointLight& light : data.points)
        one_ray_each([&](std::size_t p, std::uint32_t) { return from_point(scene_, light, lit_point(g_, p)); });
    for (const SpotLight& spot : data.spots)
        one_ray_each([&](std::size_t p, std::uint32_t) { return from_spot(scene_, spot, lit_point(g_, p)); });
    if (scene_.emitters().empty() || params_.direct_samples == 0) return;
    const float share = 1.0f / static_cast<float>(params_.direct_samples);
    PacketQueue queue(trace_, block_, Coherence::incoherent, area_);
    for_seen([&](std::size_t p, std::uint32_t row) {
        const LitPoint point = lit_point(g_, p);
        for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(params_.direct_samples); ++s) {
            const Random4 r = random4(static_cast<std::uint32_t>(p), s, Stream::area, sampler_.key());
            const DirectCandidate c = from_emitters(scene_, point, r);
            if (c.irradiance != vec3(0.0f)) queue.push(c.ray, row, c.irradiance * share);
        }
    });
    queue.flush();
}

void ShadowBlock::store_direct() {
    const auto count = static_cast<std::size_t>(across());
    for (int y = top_; y < bottom_; ++y) {
        stream_copy(&out_.direct[pixel(left_, y)], &direct_[row(left_, y)], count);
        stream_copy(&out_.area[pixel(left_, y)], &area_[row(left_, y)], count);
    }
    finish_streams();
}

}  // namespace lab
