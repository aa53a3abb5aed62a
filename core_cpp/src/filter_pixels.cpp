#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/filter_pixels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: these are compiled for each instruction set.
#include <algorithm>

#include "lab/filter_pixels.h"
#include "lab/filter_weights.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

void split(std::span<const vec3> pixels, const PixelScale& scale, float* plane, std::size_t stride) {
    const Lanes f32;
    const std::size_t lanes = hn::Lanes(f32);
    const auto factor = hn::Set(f32, scale.factor), after = hn::Set(f32, scale.scale);
    const auto most = hn::Set(f32, scale.limit), least = hn::Set(f32, -scale.limit);
    for (std::size_t x = 0; x < pixels.size(); x += lanes) {
        vec3 rest[Planes::slack];
        const vec3* from = pixels.data() + x;
        if (x + lanes > pixels.size()) {
            std::fill(rest, rest + lanes, vec3(0.0f));
            std::copy(from, pixels.data() + pixels.size(), rest);
            from = rest;
        }
        Vector v[3];
        hn::LoadInterleaved3(f32, &from->x, v[0], v[1], v[2]);
        for (int c = 0; c < 3; ++c) {
            const auto scaled = hn::Mul(hn::Sub(v[c], hn::Set(f32, scale.offset[c])), factor);
            hn::StoreU(hn::Mul(hn::Min(hn::Max(scaled, least), most), after), f32, plane + c * stride + x);
        }
    }
}

void join(const float* plane, std::size_t stride, std::span<vec3> pixels) {
    const Lanes f32;
    const std::size_t lanes = hn::Lanes(f32);
    for (std::size_t x = 0; x < pixels.size(); x += lanes) {
        vec3 rest[Planes::slack];
        const bool whole = x + lanes <= pixels.size();
        vec3* to = whole ? pixels.data() + x : rest;
        hn::StoreInterleaved3(hn::LoadU(f32, plane + x), hn::LoadU(f32, plane + stride + x),
                              hn::LoadU(f32, plane + 2 * stride + x), f32, &to->x);
        if (!whole) std::copy(rest, rest + (pixels.size() - x), pixels.data() + x);
    }
}

double sum_luminance(std::span<const vec3> pixels, const float* depth) {
    const Lanes f32;
    const hn::Rebind<double, hn::Half<Lanes>> f64;
    const std::size_t lanes = hn::Lanes(f32);
    auto sum = hn::Zero(f64);
    for (std::size_t x = 0; x < pixels.size(); x += lanes) {
        vec3 rest[Planes::slack];
        float rest_depth[Planes::slack] = {};
        const vec3* from = pixels.data() + x;
        const float* seen = depth + x;
        if (x + lanes > pixels.size()) {
            std::fill(rest, rest + lanes, vec3(0.0f));
            std::copy(from, pixels.data() + pixels.size(), rest);
            std::copy(seen, depth + pixels.size(), rest_depth);
            from = rest;
            seen = rest_depth;
        }
        Vector r, g, b;
        hn::LoadInterleaved3(f32, &from->x, r, g, b);
        const auto surface = hn::Gt(hn::LoadU(f32, seen), hn::Zero(f32));
        const auto light = hn::IfThenElseZero(surface, luminance(r, g, b));
        sum = hn::Add(sum, hn::PromoteTo(f64, hn::LowerHalf(light)));
        sum = hn::Add(sum, hn::PromoteTo(f64, hn::UpperHalf(hn::Half<Lanes>(), light)));
    }
    return hn::GetLane(hn::SumOfLanes(f64, sum));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(split);
HWY_EXPORT(join);
HWY_EXPORT(sum_luminance);

void to_planes(std::span<const vec3> pixels, const PixelScale& scale, float* plane, std::size_t stride) {
    HWY_DYNAMIC_DISPATCH(split)(pixels, scale, plane, stride);
}

void to_pixels(const float* plane, std::size_t stride, std::span<vec3> pixels) {
    HWY_DYNAMIC_DISPATCH(join)(plane, stride, pixels);
}

double luminance_sum(std::span<const vec3> pixels, const float* depth) {
    return HWY_DYNAMIC_DISPATCH(sum_luminance)(pixels, depth);
}

void deal(std::span<const float> pixels, int channels, int first, Planes& planes) {
    const auto width = static_cast<std::size_t>(planes.width());
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < planes.height(); ++y) {
        const float* line = pixels.data() + y * width * channels;
        if (channels == 1)
            std::copy_n(line, width, planes.row(first, y));
        else
            to_planes({reinterpret_cast<const vec3*>(line), width}, {}, planes.row(first, y), planes.stride());
    }
}

void collect(const Planes& planes, int first, int channels, std::span<float> pixels) {
    const auto width = static_cast<std::size_t>(planes.width());
#pragma omp parallel for schedule(static) if (planes.worth_threads())
    for (int y = 0; y < planes.height(); ++y) {
        float* line = pixels.data() + y * width * channels;
        if (channels == 1)
            std::copy_n(planes.row(first, y), width, line);
        else
            to_pixels(planes.row(first, y), planes.stride(), {reinterpret_cast<vec3*>(line), width});
    }
}

}  // namespace lab
#endif
