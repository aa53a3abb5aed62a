#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/composite.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: these are compiled for each instruction set.
#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "lab/composite_lines.h"
#include "lab/filter_weights.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

struct Vector3 {
    Vector x, y, z;
};

HWY_INLINE Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vector3 operator*(const Vector3& a, const Vector3& b) {
    return {hn::Mul(a.x, b.x), hn::Mul(a.y, b.y), hn::Mul(a.z, b.z)};
}
HWY_INLINE Vector3 operator*(const Vector3& a, Vector b) {
    return {hn::Mul(a.x, b), hn::Mul(a.y, b), hn::Mul(a.z, b)};
}
HWY_INLINE Vector dot(const Vector3& a, const Vector3& b) {
    return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
template <class Mask>
HWY_INLINE Vector3 choose(Mask mask, const Vector3& a, const Vector3& b) {
    return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}

// Up to a vector of pixels from where `count` are left.
HWY_INLINE Vector load_pixels(const float* at, int count) {
    const Lanes f32;
    if (count >= static_cast<int>(hn::Lanes(f32))) return hn::LoadU(f32, at);
    float rest[Planes::slack] = {};
    std::copy_n(at, count, rest);
    return hn::LoadU(f32, rest);
}
HWY_INLINE Vector3 load_pixels(const vec3* at, int count) {
    const Lanes f32;
    Vector3 v;
    if (count >= static_cast<int>(hn::Lanes(f32))) {
        hn::LoadInterleaved3(f32, &at->x, v.x, v.y, v.z);
        return v;
    }
    float rest[3 * Planes::slack] = {};
    std::copy_n(&at->x, 3 * count, rest);
    hn::LoadInterleaved3(f32, rest, v.x, v.y, v.z);
    return v;
}

// Three rows of planes.
HWY_INLINE Vector3 load_planes(const float* at, std::size_t stride) {
    const Lanes f32;
    return {hn::LoadU(f32, at), hn::LoadU(f32, at + stride), hn::LoadU(f32, at + 2 * stride)};
}
HWY_INLINE void store_planes(const Vector3& v, float* at, std::size_t stride) {
    const Lanes f32;
    hn::StoreU(v.x, f32, at);
    hn::StoreU(v.y, f32, at + stride);
    hn::StoreU(v.z, f32, at + 2 * stride);
}

// Written past the caches: nobody reads a picture soon.
void stream(const float* from, std::size_t count, float* to) {
    const Lanes f32;
    const std::size_t lanes = hn::Lanes(f32);
    std::size_t i = 0;
    for (; i < count && reinterpret_cast<std::uintptr_t>(to + i) % (lanes * sizeof(float)) != 0; ++i) to[i] = from[i];
    for (; i + lanes <= count; i += lanes) hn::Stream(hn::LoadU(f32, from + i), f32, to + i);
    for (; i < count; ++i) to[i] = from[i];
}

// Shadow ratios of the pixels from x on.
HWY_INLINE void take_ratios(const Compositing& c, int x, int y, int count, float* to, std::size_t stride) {
    const Lanes f32;
    const auto p = static_cast<std::size_t>(y) * c.g.width + x;
    const int channels = c.in.channels;
    std::array<Vector, 3> over, under;
    if (c.params.shadow_samples == 0) {
        for (int i = 0; i < channels; ++i) hn::StoreU(hn::Set(f32, 1.0f), f32, to + i * stride);
        return;
    }
    if (channels == 1) {
        over[0] = load_pixels(&c.in.shadowed[p], count);
        under[0] = load_pixels(&c.in.weight[p], count);
    } else {
        const auto s = load_pixels(reinterpret_cast<const vec3*>(&c.in.shadowed[3 * p]), count);
        const auto u = load_pixels(reinterpret_cast<const vec3*>(&c.in.weight[3 * p]), count);
        over = {s.x, s.y, s.z};
        under = {u.x, u.y, u.z};
    }
    const auto seen = hn::Gt(load_pixels(&c.g.depth[p], count), hn::Zero(f32));
    for (int i = 0; i < channels; ++i) {
        const auto known = hn::Gt(under[i], hn::Zero(f32));
        hn::StoreU(hn::IfThenElseZero(known, hn::Div(over[i], under[i])), f32, to + i * stride);
        if (hn::AllFalse(f32, hn::AndNot(known, seen))) continue;
        for (int k = 0; k < count; ++k)
            if (c.g.depth[p + k] > 0 && !(c.in.weight[(p + k) * channels + i] > 0))
                to[i * stride + k] = ratio_at(c.g, c.in, x + k, y, i);
    }
}

// What a window needs of line y.
void prepare_line(const Compositing& c, int y, CompositeLines& own) {
    const Lanes f32;
    const int width = c.g.width, tiles = c.tiles();
    const std::size_t stride = own.lines.stride();
    const auto nan = hn::Set(f32, std::numeric_limits<float>::quiet_NaN()), zero = hn::Zero(f32);
    for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(f32))) {
        const auto p = static_cast<std::size_t>(y) * width + x;
        const int count = width - x;
        const auto seen = hn::Gt(load_pixels(&c.g.depth[p], count), zero);
        const auto light = choose(seen, load_pixels(&c.in.irradiance[p], count), {zero, zero, zero});
        store_planes(light, own.row(own.irradiance, y) + x, stride);
        float* ratio = own.row(own.ratio, y) + x;
        take_ratios(c, x, y, std::min(count, static_cast<int>(hn::Lanes(f32))), ratio, stride);
        if (tiles == 1) continue;
        store_planes(choose(seen, load_pixels(&c.g.normal[p], count), {nan, nan, nan}), own.row(own.normal, y) + x,
                     stride);
        store_planes(load_pixels(&c.g.position[p], count), own.row(own.position, y) + x, stride);
        float* shadowed = own.row(own.shadowed(), y) + x;
        if (own.channels == 1)
            hn::StoreU(hn::Mul(luminance(light.x, light.y, light.z), hn::LoadU(f32, ratio)), f32, shadowed);
        else
            store_planes(light * load_planes(ratio, stride), shadowed, stride);
    }
    if (tiles == 1) return;
    for (int k = 1; k <= tiles / 2; ++k)
        for (const int x : {-k, width - 1 + k}) {
            const int from = folded(x, tiles, width);
            for (int plane = 0; plane < own.lines.count(); ++plane) {
                float* row = own.row(plane, y);
                const float none = plane < own.position ? std::numeric_limits<float>::quiet_NaN() : 0.0f;
                row[x] = from < 0 ? none : row[from];
            }
        }
}

// The mean of what the interleaving tiles see, shadowed by their own ratios, over a window that holds every tile with
// the same weight: n + 1 pixels a side, the outer ones counted half, so a flat, evenly lit receiver gets back the sum
// over all lights exactly. Pixels of another surface (normal, depth) stay out of it. The ratio is that of the
// recombined light, so that unshadowed * ratio stays what is shown; the pixel's own where there is no light, and where
// there are no shadows: 1, not nearly 1.
template <int channels>
void recombine_line(const Compositing& c, int y, CompositeLines& own) {
    const Lanes f32;
    const int n = c.tiles(), half = n / 2;
    const std::size_t stride = own.lines.stride(), light_stride = own.light.stride();
    const std::size_t position = own.position * stride, irradiance = own.irradiance * stride;
    const std::size_t shadowed = own.shadowed() * stride;
    const auto zero = hn::Zero(f32), aligned = hn::Set(f32, 0.8f);
    const auto shadows = hn::Gt(hn::Set(f32, static_cast<float>(c.params.shadow_samples)), zero);
    for (int x = 0; x < c.g.width; x += static_cast<int>(hn::Lanes(f32))) {
        const float* at = own.row(0, y) + x;
        const auto normal = load_planes(at, stride), point = load_planes(at + position, stride);
        const auto depth = load_pixels(&c.g.depth[static_cast<std::size_t>(y) * c.g.width + x], c.g.width - x);
        const auto footprint = hn::Mul(depth, hn::Set(f32, c.g.pixel_angle * static_cast<float>(n)));
        Vector3 unshadowed{zero, zero, zero};
        Vector total = zero, sum[channels];
        for (auto& s : sum) s = zero;
        for (int dy = -half; dy <= half; ++dy) {
            const int line = folded(y + dy, n, c.g.height);
            if (line < 0) continue;
            for (int dx = -half; dx <= half; ++dx) {
                const float* q = own.row(0, line) + x + dx;
                const auto like = hn::Ge(dot(normal, load_planes(q, stride)), aligned);
                const auto off = hn::Abs(dot(normal, load_planes(q + position, stride) - point));
                const float share = (2 * std::abs(dx) == n ? 0.5f : 1.0f) * (2 * std::abs(dy) == n ? 0.5f : 1.0f);
                const auto weight = hn::IfThenElseZero(hn::And(like, hn::Le(off, footprint)), hn::Set(f32, share));
                const auto light = load_planes(q + irradiance, stride);
                unshadowed.x = hn::MulAdd(weight, light.x, unshadowed.x);
                unshadowed.y = hn::MulAdd(weight, light.y, unshadowed.y);
                unshadowed.z = hn::MulAdd(weight, light.z, unshadowed.z);
                for (int i = 0; i < channels; ++i)
                    sum[i] = hn::MulAdd(weight, hn::LoadU(f32, q + shadowed + i * stride), sum[i]);
                total = hn::Add(total, weight);
            }
        }
        // A pixel is always of its own surface, but for a normal that is none.
        const auto found = hn::Gt(total, zero);
        const auto per_total = hn::Div(hn::Set(f32, 1.0f), hn::IfThenElse(found, total, hn::Set(f32, 1.0f)));
        const auto light = choose(found, unshadowed * per_total, load_planes(at + irradiance, stride));
        store_planes(light, own.light.row(0, 0) + x, light_stride);
        const std::array<Vector, 3> rgb{light.x, light.y, light.z};
        for (int i = 0; i < channels; ++i) {
            const auto whole = channels == 1 ? luminance(light.x, light.y, light.z) : rgb[i];
            const auto usable = hn::And(hn::And(found, shadows), hn::Gt(whole, zero));
            const auto mean = hn::Div(hn::Mul(sum[i], per_total), whole);
            const auto alone = hn::LoadU(f32, at + (own.ratio + i) * stride);
            hn::StoreU(hn::IfThenElse(usable, mean, alone), f32, own.light.row(3 + i, 0) + x);
        }
    }
}

// Shadows and direct light of line y, from the light that its pixels are to show.
void shade_line(const Compositing& c, int y, const Planes& planes, int light_plane, int slot, CompositeLines& own) {
    const Lanes f32;
    const auto first = static_cast<std::size_t>(y) * c.g.width;
    const auto width = static_cast<std::size_t>(c.g.width);
    const float *light = planes.row(light_plane, slot), *ratio = light + 3 * planes.stride();
    std::array<float*, 5> image;
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = own.image.data() + i * own.image_stride;
    const auto zero = hn::Zero(f32), one_over_pi = hn::Set(f32, std::numbers::inv_pi_v<float>);
    const Vector3 none{zero, zero, zero};
    const vec3 b = c.in.background;
    const Vector3 background{hn::Set(f32, b.x), hn::Set(f32, b.y), hn::Set(f32, b.z)};
    for (std::size_t x = 0; x < width; x += hn::Lanes(f32)) {
        const std::size_t p = first + x;
        const int count = static_cast<int>(width - x);
        const auto seen = hn::Gt(load_pixels(&c.g.depth[p], count), zero);
        const auto unshadowed = load_planes(light + x, planes.stride());
        const auto of_channel = [&](int i) {
            return hn::IfThenElseZero(seen, hn::LoadU(f32, ratio + i * planes.stride() + x));
        };
        const auto alone = of_channel(0);
        const Vector3 shadow =
            own.channels == 1 ? Vector3{alone, alone, alone} : Vector3{alone, of_channel(1), of_channel(2)};
        const auto reflectance = load_pixels(&c.g.albedo[p], count) * one_over_pi;
        auto indirect = unshadowed * shadow * reflectance;
        if (!c.in.left_out.empty()) indirect = indirect + load_pixels(&c.in.left_out[p], count) * reflectance;
        const auto arriving = load_pixels(&c.in.direct[p], count) + load_pixels(&c.in.area[p], count);
        const auto direct = load_pixels(&c.g.emission[p], count) + arriving * reflectance;
        const auto store = [&](int i, const Vector3& surface, const Vector3& otherwise) {
            const auto v = choose(seen, surface, otherwise);
            hn::StoreInterleaved3(v.x, v.y, v.z, f32, image[i] + 3 * x);
        };
        store(0, direct + indirect, background);
        store(1, direct, none);
        store(2, unshadowed, none);
        store(3, indirect, none);
        if (own.channels == 1)
            hn::StoreU(alone, f32, image[4] + x);
        else
            store(4, shadow, none);
    }
    stream(image[0], 3 * width, &c.out.colour[first].x);
    stream(image[1], 3 * width, &c.out.direct[first].x);
    stream(image[2], 3 * width, &c.out.unshadowed[first].x);
    stream(image[3], 3 * width, &c.out.indirect[first].x);
    stream(image[4], own.channels * width, &c.out.shadow_ratio[first * own.channels]);
}

// Lines [y0, y1).
void composite_strip(const Compositing& c, int y0, int y1, CompositeLines& own) {
    const int n = c.tiles(), half = n / 2;
    int next = std::max(0, y1 > c.g.height - half ? std::min(y0 - half, c.g.height - n) : y0 - half);
    for (int y = y0; y < y1; ++y) {
        // At the picture's border the window folds back by whole tiles.
        const int last = std::min(y < half ? n - 1 : y + half, c.g.height - 1);
        for (; next <= last; ++next) prepare_line(c, next, own);
        if (n == 1) {
            shade_line(c, y, own.lines, own.irradiance, y % own.count, own);
            continue;
        }
        if (own.channels == 1)
            recombine_line<1>(c, y, own);
        else
            recombine_line<3>(c, y, own);
        shade_line(c, y, own.light, 0, 0, own);
    }
    hwy::FlushStream();
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(composite_strip);

float ratio_at(const GBufferView& g, const CompositeInput& in, int x, int y, int c) {
    for (const int reach : {0, 1, 2, 4}) {
        float shadowed = 0.0f, weight = 0.0f;
        for (int qy = std::max(0, y - reach); qy <= std::min(g.height - 1, y + reach); ++qy)
            for (int qx = std::max(0, x - reach); qx <= std::min(g.width - 1, x + reach); ++qx) {
                const std::size_t q = (static_cast<std::size_t>(qy) * g.width + qx) * in.channels + c;
                shadowed += in.shadowed[q];
                weight += in.weight[q];
            }
        if (weight > 0) return shadowed / weight;
    }
    return 0.0f;
}

ImageData composite(const GBufferView& g, const CompositeInput& in, const Params& params) {
    constexpr int lines = 24;  // of a strip
    ImageData out;
    for (auto* plane : {&out.colour, &out.direct, &out.unshadowed, &out.indirect}) plane->resize(g.pixels());
    out.shadow_ratio.resize(g.pixels() * in.channels);
    if (g.pixels() == 0) return out;
    const Compositing compositing{g, in, params, out};
#pragma omp parallel if (g.pixels() >= 4096)
    {
        CompositeLines own(g.width, in.channels, params.interleave);
#pragma omp for schedule(dynamic)
        for (int y = 0; y < g.height; y += lines)
            HWY_DYNAMIC_DISPATCH(composite_strip)(compositing, y, std::min(y + lines, g.height), own);
    }
    return out;
}

}  // namespace lab
#endif
