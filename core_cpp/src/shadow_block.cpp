#include "lab/shadow_block.h"

#include <algorithm>
#include <bit>

#include "lab/direct_light.h"
#include "lab/radix_sort.h"
#include "lab/select.h"
#include "lab/shadow_sums.h"
#include "lab/stream_copy.h"

namespace lab {
namespace {

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

std::vector<PixelSquare> shadow_blocks(const GBufferView& g, const Params& params) {
    constexpr int samples = 1 << RayOrder::sample_bits;
    static_assert(max_shadow_samples <= samples);
    int side = 128;
    while (side * side * params.shadow_samples > samples) side /= 2;
    std::vector<PixelSquare> squares;
    for (int top = 0; top < g.height; top += side)
        for (int left = 0; left < g.width; left += side) squares.push_back({left, top, side});
    return squares;
}

void ShadowBlock::shade(const PixelSquare& square, std::size_t block) {
    block_ = block;
    side_ = square.side;
    left_ = square.left;
    top_ = square.top;
    right_ = std::min(g_.width, left_ + side_);
    bottom_ = std::min(g_.height, top_ + side_);
    find_origins();
    if (params_.shadow_samples > 0) {
        collect_rays();
        trace_samples();
    }
    if (params_.shadow_estimator == ShadowEstimator::ratio_rgb)
        accumulate_rgb();
    else
        accumulate();
    light_directly();
    store_direct();
}

void ShadowBlock::find_origins() {
    origins_.resize(static_cast<std::size_t>(side_) * side_);
    for (int y = top_; y < bottom_; ++y) {
        RayOrigin* origin = &origins_[row(left_, y)];
        for (std::size_t p = pixel(left_, y); p < pixel(right_, y); ++p)
            *origin++ = {scene_.off_surface(g_.position[p], g_.geometric_normal[p])};
    }
}

// The samples' rays, by where they end. Those that end together follow each other as their pixels do in a narrow
// column.
void ShadowBlock::collect_rays() {
    constexpr int narrow = 16;
    const int k = params_.shadow_samples;
    rays_.resize(origins_.size() * k + RayOrder::slack);
    spare_.resize(rays_.size());
    RayKey* end = rays_.data();
    for (int left = left_; left < right_; left += narrow) {
        const auto samples = static_cast<std::size_t>(std::min(narrow, right_ - left)) * k;
        for (int y = top_; y < bottom_; ++y) {
            const std::size_t first = pixel(left, y) * k;
            const float* share = &out_.omega[first];
            // S ignores rays whose share is zero; the average counts every one.
            if (params_.shadow_estimator == ShadowEstimator::average) {
                share_.resize(samples);
                for (std::size_t i = 0; i < samples; ++i) share_[i] = lighting_.light[first + i] >= 0 ? 1.0f : 0.0f;
                share = share_.data();
            }
            end = order_.append({&out_.point[first], samples}, share, row(left, y) * k, end);
        }
    }
    count_ = static_cast<std::size_t>(end - rays_.data());
}

// Rays that end near each other go together: they begin near each other as well, and stay in one part of the tree.
void ShadowBlock::trace_samples() {
    const int k = params_.shadow_samples;
    free_.assign(origins_.size() * k, 0);
    if (count_ == 0) return;
    RayKey* rays = radix_sort<RayOrder::sample_bits>(rays_.data(), spare_.data(), count_);
    std::fill_n(rays + count_, RayPacket::size - 1, rays[count_ - 1]);
    const BlockSamples samples{std::countr_zero(static_cast<unsigned>(side_)), k, static_cast<std::uint32_t>(g_.width),
                               origins_.data(), &out_.point[pixel(left_, top_) * k]};
    // While one packet is traced, what the next is made of comes nearer.
    RayPacket packet;
    PacketSamples found[2];
    find_samples(samples, rays, found[0]);
    for (std::size_t first = 0; first < count_; first += RayPacket::size) {
        const PacketSamples& now = found[first / RayPacket::size % 2];
        fill_packet(samples, now, shadow_ray_length, packet);
        const std::size_t next = first + RayPacket::size;
        if (next < count_) find_samples(samples, rays + next, found[next / RayPacket::size % 2]);
        const int count = static_cast<int>(std::min<std::size_t>(RayPacket::size, count_ - first));
        const std::uint32_t free = trace_(block_, packet, count, Coherence::incoherent);
        for (int i = 0; i < count; ++i) free_[now.sample[i]] = (free >> i) & 1u;
    }
}

void ShadowBlock::accumulate() {
    const int k = params_.shadow_samples;
    const auto pixels = static_cast<std::size_t>(across());
    weight_.assign(pixels, 0.0f);
    shadowed_.assign(pixels, 0.0f);
    for (int y = top_; y < bottom_; ++y) {
        const std::size_t first = pixel(left_, y);
        if (k > 0) {
            const std::uint8_t* free = &free_[row(left_, y) * k];
            stream_copy(&out_.visible[first * k], free, pixels * k);
            sum_samples({&lighting_.light[first * k], &out_.omega[first * k], free, k, pixels},
                        params_.shadow_estimator, weight_.data(), shadowed_.data());
        }
        stream_copy(&out_.weight[first], weight_.data(), pixels);
        stream_copy(&out_.shadowed[first], shadowed_.data(), pixels);
    }
}

void ShadowBlock::accumulate_rgb() {
    const int k = params_.shadow_samples;
    const float mean = 1.0f / static_cast<float>(k);
    for (int y = top_; y < bottom_; ++y) {
        for (int x = left_; x < right_; ++x) {
            const std::size_t p = pixel(x, y);
            const std::uint8_t* free = free_.data() + row(x, y) * static_cast<std::size_t>(k);
            vec3 weight(0.0f), shadowed(0.0f);
            for (int s = 0; s < k; ++s) {
                const std::size_t sample = p * k + s;
                out_.visible[sample] = free[s];
                if (lighting_.light[sample] < 0) continue;
                const vec3 share = sampler_.share_rgb(p, sample, out_.omega[sample]) * mean;
                weight += share;
                if (free[s] != 0) shadowed += share;
            }
            for (int c = 0; c < 3; ++c) {
                out_.weight[p * 3 + c] = weight[c];
                out_.shadowed[p * 3 + c] = shadowed[c];
            }
        }
    }
}

// Squares of 4 x 4 pixels, which direct light traces as packets.
template <class Visit>
void ShadowBlock::for_squares(const Visit& visit) const {
    for (int y = top_; y < bottom_; y += 4)
        for (int x = left_; x < right_; x += 4) visit(x, y, std::min(right_, x + 4), std::min(bottom_, y + 4));
}

// The block's pixels that show a surface, by squares.
template <class Visit>
void ShadowBlock::for_seen(const Visit& visit) const {
    for_squares([&](int x0, int y0, int x1, int y1) {
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x)
                if (const std::size_t p = pixel(x, y); g_.depth[p] > 0) visit(p, row(x, y));
    });
}

// Rays of all pixels that a sun shines on have one direction, of which a packet is filled once.
void ShadowBlock::light_by(const SunLight& sun) {
    cosine_.resize(origins_.size());
    for (int y = top_; y < bottom_; ++y) {
        float* cosine = &cosine_[row(left_, y)];
        for (std::size_t p = pixel(left_, y); p < pixel(right_, y); ++p)
            *cosine++ = g_.depth[p] > 0 ? larger(0.0f, glm::dot(g_.normal[p], sun.to_sun)) : 0.0f;
    }
    RayPacket packet;
    std::uint32_t to[RayPacket::size];
    int count = 0;
    for (int i = 0; i < RayPacket::size; ++i) packet.set(i, vec3(0.0f), sun.to_sun, 0.0f);
    const auto trace = [&] {
        if (count == 0) return;
        for (int i = 0; i < RayPacket::size; ++i) {
            const vec3& origin = origins_[to[std::min(i, count - 1)]].of;
            packet.origin_x[i] = origin.x;
            packet.origin_y[i] = origin.y;
            packet.origin_z[i] = origin.z;
            packet.length[i] = std::numeric_limits<float>::infinity();
        }
        const std::uint32_t free = trace_(block_, packet, count, Coherence::coherent);
        for (int i = 0; i < count; ++i)
            direct_[to[i]] += (free >> i & 1u) != 0 ? sun.irradiance * cosine_[to[i]] : vec3(0.0f);
        count = 0;
    };
    for_squares([&](int x0, int y0, int x1, int y1) {
        for (int y = y0; y < y1; ++y)
            for (std::uint32_t at = row(x0, y); at < row(x1, y); ++at) {
                to[count] = at;
                count += cosine_[at] > 0;
                if (count == RayPacket::size) trace();
            }
    });
    trace();
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
    for (const SunLight& sun : data.suns) light_by(sun);
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
