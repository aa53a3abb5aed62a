#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/ray_order.cpp"
#include <hwy/foreach_target.h>

#include <cstddef>

#include "lab/ray_order.h"
#include "lab/select.h"
#include "lab/side_by_side.h"

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

LAB_INLINE std::uint32_t spread(std::uint32_t x) {
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

LAB_INLINE std::uint32_t cell(float at, float low, float cells) {
    constexpr float last = (1 << RayOrder::axis_bits) - 1;
    const float inside = larger(0.0f, smaller(last, (at - low) * cells));
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(inside));
}

// Whole vectors of samples; returns how many keys it wrote.
std::size_t append_vectors(const RayOrder& order, const float* points, const float* share, std::size_t count,
                           std::uint32_t first, RayKey* keys) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::ScalableTag<float> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    const std::size_t lanes = hn::Lanes(d);
    const float cells = order.cells();
    const vec3 low = order.low();
    std::size_t written = 0;
    for (std::size_t i = 0; i < count; i += lanes) {
        hn::Vec<decltype(d)> x, y, z;
        hn::LoadInterleaved3(d, points + 3 * i, x, y, z);
        float at[3][RayOrder::slack];
        hn::StoreU(x, d, at[0]);
        hn::StoreU(y, d, at[1]);
        hn::StoreU(z, d, at[2]);
        RayKey key[RayOrder::slack];
#pragma omp simd
        for (std::size_t j = 0; j < lanes; ++j) {
            const std::uint32_t place = spread(cell(at[0][j], low.x, cells)) |
                                        spread(cell(at[1][j], low.y, cells)) << 1 |
                                        spread(cell(at[2][j], low.z, cells)) << 2;
            key[j] = place << RayOrder::sample_bits | (first + static_cast<std::uint32_t>(i + j));
        }
        const auto kept = hn::RebindMask(du, hn::Gt(hn::LoadU(d, share + i), hn::Zero(d)));
        // In a register: compressing into memory takes some processors a hundred cycles.
        hn::StoreU(hn::Compress(hn::LoadU(du, key), kept), du, keys + written);
        written += hn::CountTrue(du, kept);
    }
    return written;
}

std::size_t Append(const RayOrder& order, const vec3* points, const float* share, std::size_t count,
                   std::uint32_t first, RayKey* keys) {
    constexpr std::size_t slack = RayOrder::slack;
    const std::size_t whole = count / slack * slack, rest = count - whole;
    std::size_t written = append_vectors(order, &points->x, share, whole, first, keys);
    if (rest == 0) return written;
    vec3 last_points[slack];
    float last_share[slack] = {};
    for (std::size_t i = 0; i < slack; ++i) last_points[i] = points[whole + (i < rest ? i : 0)];
    for (std::size_t i = 0; i < rest; ++i) last_share[i] = share[whole + i];
    written += append_vectors(order, &last_points[0].x, last_share, slack, first + static_cast<std::uint32_t>(whole),
                              keys + written);
    return written;
}

// Rows of three numbers, of which a fourth is read as well, brought side by side.
void points_side_by_side(const vec3* points, const std::uint32_t* index, float (*columns)[RayPacket::size]) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::CappedTag<float, RayPacket::size> d;
    for (int i = 0; i < RayPacket::size; i += static_cast<int>(hn::Lanes(d))) {
        const auto found = four_columns(d, [&](int j) HWY_ATTR { return &points[index[i + j]].x; });
        for (int c = 0; c < 3; ++c) hn::StoreU(found.at[c], d, columns[c] + i);
    }
}

void FindSamples(const BlockSamples& block, const RayKey* keys, PacketSamples& out) {
    constexpr int size = RayPacket::size;
    const auto each = static_cast<std::uint32_t>(block.each), side_bits = static_cast<std::uint32_t>(block.side_bits);
    const std::uint32_t across = (1u << side_bits) - 1u, width = block.image_width;
    const float share = 1.0f / static_cast<float>(block.each);
#pragma omp simd
    for (int i = 0; i < size; ++i) {
        const std::uint32_t sample = keys[i] & ((1u << RayOrder::sample_bits) - 1u);
        // Exact: the numbers are small, and half a sample keeps them off whole pixels.
        const float pixels = (static_cast<float>(static_cast<std::int32_t>(sample)) + 0.5f) * share;
        const auto pixel = static_cast<std::uint32_t>(static_cast<std::int32_t>(pixels));
        const std::uint32_t in_image = (pixel >> side_bits) * width + (pixel & across);
        out.sample[i] = sample;
        out.pixel[i] = pixel;
        out.point[i] = in_image * each + (sample - pixel * each);
    }
    for (int i = 0; i < size; ++i) {
        hwy::Prefetch(block.origin + out.pixel[i]);
        hwy::Prefetch(block.point + out.point[i]);
    }
}

void FillPacket(const BlockSamples& block, const PacketSamples& samples, float length, RayPacket& packet) {
    constexpr int size = RayPacket::size;
    using Columns = float[size];
    static_assert(sizeof(RayOrigin) == 16 && offsetof(RayPacket, start) == 3 * sizeof(Columns));
    float target[3][size];
    points_side_by_side(block.point, samples.point, target);
    side_by_side<1>(block.origin, samples.pixel, size, reinterpret_cast<Columns*>(&packet));
#pragma omp simd
    for (int i = 0; i < size; ++i) {
        packet.direction_x[i] = target[0][i] - packet.origin_x[i];
        packet.direction_y[i] = target[1][i] - packet.origin_y[i];
        packet.direction_z[i] = target[2][i] - packet.origin_z[i];
        packet.length[i] = length;
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(Append);
HWY_EXPORT(FindSamples);
HWY_EXPORT(FillPacket);

RayKey* RayOrder::append(std::span<const vec3> points, const float* share, std::uint32_t first, RayKey* keys) const {
    return keys + HWY_DYNAMIC_DISPATCH(Append)(*this, points.data(), share, points.size(), first, keys);
}

void find_samples(const BlockSamples& block, const RayKey* keys, PacketSamples& samples) {
    HWY_DYNAMIC_DISPATCH(FindSamples)(block, keys, samples);
}

void fill_packet(const BlockSamples& block, const PacketSamples& samples, float length, RayPacket& packet) {
    HWY_DYNAMIC_DISPATCH(FillPacket)(block, samples, length, packet);
}

}  // namespace lab
#endif
