#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/ray_order.cpp"
#include <hwy/foreach_target.h>

#include <cstddef>

#include "lab/ray_order.h"
#include "lab/select.h"
#include "lab/side_by_side.h"

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

void Places(const RayOrder& order, const vec3* points, std::size_t count, std::uint32_t* place) {
    const float cells = order.cells();
    const vec3 low = order.low();
#pragma omp simd
    for (std::size_t j = 0; j < count; ++j)
        place[j] = spread(cell(points[j].x, low.x, cells)) | spread(cell(points[j].y, low.y, cells)) << 1 |
                   spread(cell(points[j].z, low.z, cells)) << 2;
}

void FillPacket(const RayRow* origins, const std::uint32_t* origin, const RayRow* directions,
                const std::uint32_t* direction, RayPacket& packet) {
    using Columns = float[RayPacket::size];
    static_assert(sizeof(RayRow) == 16 && offsetof(RayPacket, start) == 3 * sizeof(Columns));
    static_assert(offsetof(RayPacket, direction_x) == 4 * sizeof(Columns));
    static_assert(offsetof(RayPacket, time) == 7 * sizeof(Columns));
    side_by_side<1>(origins, origin, RayPacket::size, reinterpret_cast<Columns*>(&packet));
    side_by_side<1>(directions, direction, RayPacket::size, reinterpret_cast<Columns*>(&packet) + 4);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(Places);
HWY_EXPORT(FillPacket);

void RayOrder::places(std::span<const vec3> points, std::uint32_t* place) const {
    HWY_DYNAMIC_DISPATCH(Places)(*this, points.data(), points.size(), place);
}

void fill_packet(const RayRow* origins, const std::uint32_t* origin, const RayRow* directions,
                 const std::uint32_t* direction, RayPacket& packet) {
    HWY_DYNAMIC_DISPATCH(FillPacket)(origins, origin, directions, direction, packet);
}

}  // namespace lab
#endif
