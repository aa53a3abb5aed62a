#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/render_gbuffer.cpp"
#include <hwy/foreach_target.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/render_gbuffer.h"
#include "lab/reservoir.h"
#include "lab/select.h"
#include "lab/side_by_side.h"
#include "lab/stream_copy.h"
#include "lab/texture_lanes.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int lanes = RayPacket::size;
using Lanes = float[lanes];

int FillRays(const PixelBlocks& blocks, int column, int row, RayPacket& packet) {
    const int left = column * PixelBlocks::side, top = row * PixelBlocks::side;
    const int across = std::min(PixelBlocks::side, blocks.width() - left);
    const int count = across * std::min(PixelBlocks::side, blocks.height() - top);
    double x[lanes], y[lanes];
    for (int i = 0; i < lanes; ++i) {
        const int pixel = std::min(i, count - 1);
        x[i] = left + pixel % across + 0.5;
        y[i] = top + pixel / across + 0.5;
    }
    const CameraRays& camera = blocks.camera();
    const vec3 eye = camera.eye();
#pragma omp simd
    for (int i = 0; i < lanes; ++i) {
        const vec3 direction = camera.direction(x[i], y[i]);
        packet.origin_x[i] = eye.x;
        packet.origin_y[i] = eye.y;
        packet.origin_z[i] = eye.z;
        packet.direction_x[i] = direction.x;
        packet.direction_y[i] = direction.y;
        packet.direction_z[i] = direction.z;
        packet.length[i] = std::numeric_limits<float>::infinity();
    }
    return count;
}

// Sixteen hits, their corners and materials, column by column as the rows of Scene::vertices() and materials() are.
struct Corners {
    Lanes a[12], b[12], c[12], material[8];
};

// What the camera sees there.
struct Seen {
    Lanes position[3], geometric_normal[3], normal[3], albedo[3], emission[3], depth;
    Lanes u, v, level;  // of the texture; to the level comes log2(texels) / 2
};

void find_corners(const Scene& scene, const HitPacket& hits, int count, Corners& corners) {
    const SceneData& data = scene.data();
    std::uint32_t index[4][lanes];
    for (int i = 0; i < lanes; ++i) {
        const std::uint32_t t = i < count && hits.triangle[i] != Hit::none ? hits.triangle[i] : 0;
        const glm::uvec3 corner = data.triangle[t];
        index[0][i] = corner.x;
        index[1][i] = corner.y;
        index[2][i] = corner.z;
        index[3][i] = data.material_of[t];
    }
    side_by_side<3>(scene.vertices().data(), index[0], lanes, corners.a);
    side_by_side<3>(scene.vertices().data(), index[1], lanes, corners.b);
    side_by_side<3>(scene.vertices().data(), index[2], lanes, corners.c);
    side_by_side<2>(scene.materials().data(), index[3], lanes, corners.material);
}

// As Scene::surface() and Surface::turn_toward(), for all hits at once. The cross product in double, as there.
void see_geometry(const RayPacket& rays, const HitPacket& hits, const Corners& corners, float pixel_angle, Seen& seen) {
    const auto &a = corners.a, &b = corners.b, &c = corners.c;
#pragma omp simd
    for (int i = 0; i < lanes; ++i) {
        const float u = hits.u[i], v = hits.v[i], w = 1 - u - v;
        for (int k = 0; k < 3; ++k) seen.position[k][i] = w * a[k][i] + u * b[k][i] + v * c[k][i];
        const double ex = double{b[0][i]} - a[0][i], ey = double{b[1][i]} - a[1][i], ez = double{b[2][i]} - a[2][i];
        const double fx = double{c[0][i]} - a[0][i], fy = double{c[1][i]} - a[1][i], fz = double{c[2][i]} - a[2][i];
        const double cx = ey * fz - ez * fy, cy = ez * fx - ex * fz, cz = ex * fy - ey * fx;
        const double length = std::sqrt(cx * cx + cy * cy + cz * cz), scale = length > 0 ? 1 / length : 0;
        const float gx = static_cast<float>(cx * scale), gy = static_cast<float>(cy * scale);
        const float gz = static_cast<float>(cz * scale);
        const float dx = rays.direction_x[i], dy = rays.direction_y[i], dz = rays.direction_z[i];
        const float along = gx * dx + gy * dy + gz * dz;
        const float turn = along <= 0 ? 1.0f : -1.0f;
        seen.geometric_normal[0][i] = turn * gx;
        seen.geometric_normal[1][i] = turn * gy;
        seen.geometric_normal[2][i] = turn * gz;

        const float nx = w * a[4][i] + u * b[4][i] + v * c[4][i], ny = w * a[5][i] + u * b[5][i] + v * c[5][i];
        const float nz = w * a[6][i] + u * b[6][i] + v * c[6][i];
        const float n_length = std::sqrt(nx * nx + ny * ny + nz * nz);
        const bool smooth = n_length > 1e-6f;
        const float n_scale = 1 / (smooth ? n_length : 1.0f);
        const float sx = smooth ? nx * n_scale : gx, sy = smooth ? ny * n_scale : gy, sz = smooth ? nz * n_scale : gz;
        const float side = (sx * gx + sy * gy + sz * gz) * turn < 0 ? -1.0f : 1.0f;
        seen.normal[0][i] = side * sx;
        seen.normal[1][i] = side * sy;
        seen.normal[2][i] = side * sz;

        const float shown = along <= 0 ? 1.0f : corners.material[7][i];
        for (int k = 0; k < 3; ++k) {
            seen.albedo[k][i] = corners.material[k][i] * (w * a[8 + k][i] + u * b[8 + k][i] + v * c[8 + k][i]);
            seen.emission[k][i] = shown > 0 ? corners.material[4 + k][i] : 0.0f;
        }
        seen.u[i] = w * a[3][i] + u * b[3][i] + v * c[3][i];
        seen.v[i] = w * a[7][i] + u * b[7][i] + v * c[7][i];
        // Texels per pixel: ratio of the triangle's areas in the texture and in space, by the ray's cone there.
        const float eu = b[3][i] - a[3][i], ev = b[7][i] - a[7][i], fu = c[3][i] - a[3][i], fv = c[7][i] - a[7][i];
        const float cone = hits.t[i] * pixel_angle, slope = larger(0.05f, magnitude(along));
        const float share = magnitude(eu * fv - ev * fu) / static_cast<float>(length) * (cone * cone / slope);
        seen.level[i] = 0.5f * (natural_log(share) * std::numbers::log2e_v<float>);
    }
}

// Depths, and zeros wherever the camera sees nothing.
void finish(const CameraRays& camera, const RayPacket& rays, const HitPacket& hits, Seen& seen) {
#pragma omp simd
    for (int i = 0; i < lanes; ++i) {
        const vec3 direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
        const float depth = camera.depth(direction, hits.t[i]);
        seen.depth[i] = hits.triangle[i] != Hit::none ? depth : 0.0f;
    }
    for (auto* plane : {seen.position, seen.geometric_normal, seen.normal, seen.albedo, seen.emission})
        for (int k = 0; k < 3; ++k)
#pragma omp simd
            for (int i = 0; i < lanes; ++i) plane[k][i] = hits.triangle[i] != Hit::none ? plane[k][i] : 0.0f;
}

vec3 lane(const Lanes* columns, int i) {
    return {columns[0][i], columns[1][i], columns[2][i]};
}

// Some blocks side by side: so many that their rows are whole lines of memory, which are written without being read
// before, and that the textures' memory comes while other blocks are traced.
constexpr int strip_blocks = 4;

struct Strip {
    static constexpr int width = strip_blocks * PixelBlocks::side, height = PixelBlocks::side;
    using Plane = vec3[height][width];
    Plane position, normal, geometric_normal, albedo, emission;
    float depth[height][width];
};

// A whole block: each of its rows is four pixels, twelve numbers.
HWY_INLINE void put_block(const Lanes* columns, int left, Strip::Plane& plane) {
    const hn::Full128<float> d;
    for (int row = 0; row < PixelBlocks::side; ++row) {
        const int i = row * PixelBlocks::side;
        hn::StoreInterleaved3(hn::LoadU(d, columns[0] + i), hn::LoadU(d, columns[1] + i), hn::LoadU(d, columns[2] + i),
                              d, &plane[row][left].x);
    }
}

// The block at pixel `left` of the strip; `across`: how many pixels wide the image lets it be.
HWY_INLINE void put(const Seen& seen, int left, int across, int count, Strip& strip) {
    if (count == lanes) {
        put_block(seen.position, left, strip.position);
        put_block(seen.geometric_normal, left, strip.geometric_normal);
        put_block(seen.normal, left, strip.normal);
        put_block(seen.albedo, left, strip.albedo);
        put_block(seen.emission, left, strip.emission);
        for (int row = 0; row < PixelBlocks::side; ++row)
            std::copy_n(seen.depth + row * PixelBlocks::side, PixelBlocks::side, strip.depth[row] + left);
        return;
    }
    for (int i = 0; i < count; ++i) {
        const int x = left + i % across, y = i / across;
        strip.position[y][x] = lane(seen.position, i);
        strip.geometric_normal[y][x] = lane(seen.geometric_normal, i);
        strip.normal[y][x] = lane(seen.normal, i);
        strip.albedo[y][x] = lane(seen.albedo, i);
        strip.emission[y][x] = lane(seen.emission, i);
        strip.depth[y][x] = seen.depth[i];
    }
}

void store(const Strip& strip, const PixelBlocks& blocks, int left, int top, GBufferData& g) {
    const auto across = static_cast<std::size_t>(std::min(Strip::width, blocks.width() - left));
    for (int y = 0; y < std::min(Strip::height, blocks.height() - top); ++y) {
        const std::size_t first = static_cast<std::size_t>(top + y) * blocks.width() + left;
        stream_copy(&g.position[first], strip.position[y], across);
        stream_copy(&g.geometric_normal[first], strip.geometric_normal[y], across);
        stream_copy(&g.normal[first], strip.normal[y], across);
        stream_copy(&g.albedo[first], strip.albedo[y], across);
        stream_copy(&g.emission[first], strip.emission[y], across);
        stream_copy(&g.depth[first], strip.depth[y], across);
    }
}

// A block between tracing and shading.
struct Traced {
    RayPacket rays;
    HitPacket hits;
    int count;
    Seen seen;
    Lanes texture;
    TexelLanes texels;
};

void RenderRow(const Scene& scene, const PixelBlocks& blocks, int row, GBufferData& g) {
    Traced traced[strip_blocks];
    Corners corners;
    Strip strip;
    for (int column = 0; column < blocks.columns(); column += strip_blocks) {
        const int wide = std::min(strip_blocks, blocks.columns() - column);
        for (int b = 0; b < wide; ++b) {
            Traced& t = traced[b];
            t.count = FillRays(blocks, column + b, row, t.rays);
            scene.rays().intersect(t.rays, t.count, Coherence::coherent, t.hits);
            find_corners(scene, t.hits, t.count, corners);
            see_geometry(t.rays, t.hits, corners, g.pixel_angle, t.seen);
            std::copy_n(corners.material[3], lanes, t.texture);
            find_texels(scene, t.texture, t.seen.u, t.seen.v, t.seen.level, t.texels);
        }
        const int left = column * PixelBlocks::side;
        for (int b = 0; b < wide; ++b) {
            Traced& t = traced[b];
            multiply_textures(t.texture, t.texels, t.seen.albedo);
            finish(blocks.camera(), t.rays, t.hits, t.seen);
            const int x = b * PixelBlocks::side;
            put(t.seen, x, std::min(PixelBlocks::side, blocks.width() - left - x), t.count, strip);
        }
        store(strip, blocks, left, row * PixelBlocks::side, g);
    }
    finish_streams();
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(FillRays);
HWY_EXPORT(RenderRow);

int PixelBlocks::rays(int column, int row, RayPacket& packet) const {
    return HWY_DYNAMIC_DISPATCH(FillRays)(*this, column, row, packet);
}

GBufferData render_gbuffer(const Scene& scene, const Camera& camera, int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    GBufferData g;
    for (auto* plane : {&g.position, &g.normal, &g.geometric_normal, &g.albedo, &g.emission}) plane->resize(pixels);
    g.depth.resize(pixels);
    const PixelBlocks blocks(camera, width, height);
    g.pixel_angle = blocks.camera().pixel_angle();
#pragma omp parallel for schedule(dynamic)
    for (int row = 0; row < blocks.rows(); ++row) HWY_DYNAMIC_DISPATCH(RenderRow)(scene, blocks, row, g);
    return g;
}

}  // namespace lab
#endif
