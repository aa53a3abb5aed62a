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
    constexpr int side = PixelBlocks::side;
    const int left = column * side, top = row * side;
    const int across = std::min(side, blocks.width() - left);
    const int count = across * std::min(side, blocks.height() - top);
    double x[lanes], y[lanes];
    for (int i = 0; i < lanes; ++i) {
        x[i] = left + i % side + 0.5;
        y[i] = top + i / side + 0.5;
    }
    if (count < lanes)
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

// Sixteen hits: what their triangles' corners have at them, and what the whole triangles have.
struct alignas(64) Found {
    Lanes normal[3], geometric_normal[3];  // as modelled
    Lanes u, v, detail, levels;
};

// What the camera sees there.
struct alignas(64) Seen {
    Lanes position[3], geometric_normal[3], normal[3], albedo[3], emission[3], depth;
};

void find(const Scene& scene, const HitPacket& hits, Found& found, Seen& seen) {
    using Corner = TriangleRow::Corner;
    static_assert(sizeof(Corner) == 32 && sizeof(TriangleRow) == 128);
    std::uint32_t triangle[lanes];
    Lanes w;
#pragma omp simd
    for (int i = 0; i < lanes; ++i) {
        triangle[i] = hits.triangle[i] != Hit::none ? hits.triangle[i] : 0;
        w[i] = 1 - hits.u[i] - hits.v[i];
    }
    const TriangleRow* rows = scene.triangles().data();
    alignas(64) float mean[lanes][8];  // of the corners
    const hn::CappedTag<float, 8> row_tag;
    for (int i = 0; i < lanes; ++i) {
        const auto* corner = reinterpret_cast<const float*>(&rows[triangle[i]]);
        const auto wa = hn::Set(row_tag, w[i]), ub = hn::Set(row_tag, hits.u[i]), vc = hn::Set(row_tag, hits.v[i]);
        for (std::size_t k = 0; k < 8; k += hn::Lanes(row_tag)) {
            const auto a = hn::LoadU(row_tag, corner + k), b = hn::LoadU(row_tag, corner + 8 + k);
            const auto c = hn::LoadU(row_tag, corner + 16 + k);
            hn::Store(hn::MulAdd(vc, c, hn::MulAdd(ub, b, hn::Mul(wa, a))), row_tag, mean[i] + k);
        }
    }
    const hn::CappedTag<float, lanes> d;
    for (std::size_t i = 0; i < lanes; i += hn::Lanes(d)) {
        const auto store = [&](const auto& columns, float (&three)[3][lanes], float* fourth) HWY_ATTR {
            for (int c = 0; c < 3; ++c) hn::StoreU(columns.at[c], d, three[c] + i);
            hn::StoreU(columns.at[3], d, fourth + i);
        };
        const auto whole = [&](int j) HWY_ATTR { return reinterpret_cast<const float*>(&rows[triangle[i + j]]) + 24; };
        store(four_columns(d, [&](int j) HWY_ATTR { return mean[i + j]; }), seen.position, found.u);
        store(four_columns(d, [&](int j) HWY_ATTR { return mean[i + j] + 4; }), found.normal, found.v);
        store(four_columns(d, whole), found.geometric_normal, found.detail);
        store(four_columns(d, [&](int j) HWY_ATTR { return whole(j) + 4; }), seen.albedo, found.levels);
    }
}

// As Scene::surface() and Surface::turn_toward(), for all hits at once. `level`: of the texture.
void see(const CameraRays& camera, const RayPacket& rays, const HitPacket& hits, const Found& found, Seen& seen,
         float* level) {
    const float pixel_angle = camera.pixel_angle();
#pragma omp simd
    for (int i = 0; i < lanes; ++i) {
        const float gx = found.geometric_normal[0][i], gy = found.geometric_normal[1][i];
        const float gz = found.geometric_normal[2][i];
        const float dx = rays.direction_x[i], dy = rays.direction_y[i], dz = rays.direction_z[i];
        const float along = gx * dx + gy * dy + gz * dz;
        const float turn = along <= 0 ? 1.0f : -1.0f;
        seen.geometric_normal[0][i] = turn * gx;
        seen.geometric_normal[1][i] = turn * gy;
        seen.geometric_normal[2][i] = turn * gz;

        const float nx = found.normal[0][i], ny = found.normal[1][i], nz = found.normal[2][i];
        const float n_length = std::sqrt(nx * nx + ny * ny + nz * nz);
        const bool smooth = n_length > 1e-6f;
        const float n_scale = 1 / (smooth ? n_length : 1.0f);
        const float sx = smooth ? nx * n_scale : gx, sy = smooth ? ny * n_scale : gy, sz = smooth ? nz * n_scale : gz;
        const float side = (sx * gx + sy * gy + sz * gz) * turn < 0 ? -1.0f : 1.0f;
        seen.normal[0][i] = side * sx;
        seen.normal[1][i] = side * sy;
        seen.normal[2][i] = side * sz;

        seen.depth[i] = camera.depth({dx, dy, dz}, hits.t[i]);
        // Texels per pixel: those per length of the triangle, by the ray's cone there.
        const float cone = hits.t[i] * pixel_angle, slope = larger(0.05f, magnitude(along));
        level[i] = found.detail[i] + 0.5f * std::numbers::log2e_v<float> * natural_log(cone * cone / slope);
    }
}

// What few scenes have: vertices with colours, and surfaces that emit.
void see_colours(const Scene& scene, const HitPacket& hits, Seen& seen) {
    for (int i = 0; i < lanes; ++i) {
        if (hits.triangle[i] == Hit::none) continue;
        const vec3 colour = scene.vertex_colour({hits.triangle[i], hits.t[i], hits.u[i], hits.v[i]});
        for (int k = 0; k < 3; ++k) seen.albedo[k][i] *= colour[k];
    }
}

void see_emission(const Scene& scene, const RayPacket& rays, const HitPacket& hits, const Found& found, Seen& seen) {
    const SceneData& data = scene.data();
    for (int i = 0; i < lanes; ++i) {
        if (hits.triangle[i] == Hit::none) continue;
        const auto& g = found.geometric_normal;
        const float along =
            g[0][i] * rays.direction_x[i] + g[1][i] * rays.direction_y[i] + g[2][i] * rays.direction_z[i];
        const Material& material = data.materials[data.material_of[hits.triangle[i]]];
        const bool shown = along <= 0 || material.two_sided;
        for (int k = 0; k < 3; ++k) seen.emission[k][i] = shown ? material.emission[k] : 0.0f;
    }
}

// Zeros wherever the camera sees nothing.
void hide_misses(const HitPacket& hits, Seen& seen) {
    for (auto* plane : {seen.position, seen.geometric_normal, seen.normal, seen.albedo, seen.emission})
        for (int k = 0; k < 3; ++k)
#pragma omp simd
            for (int i = 0; i < lanes; ++i) plane[k][i] = hits.triangle[i] != Hit::none ? plane[k][i] : 0.0f;
#pragma omp simd
    for (int i = 0; i < lanes; ++i) seen.depth[i] = hits.triangle[i] != Hit::none ? seen.depth[i] : 0.0f;
}

vec3 lane(const Lanes* columns, int i) {
    return {columns[0][i], columns[1][i], columns[2][i]};
}

// Some blocks side by side: so many that their rows are whole lines of memory, which are written without being read
// before, and that the textures' memory comes while other blocks are traced.
constexpr int strip_blocks = 4;

struct alignas(64) Strip {
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
HWY_INLINE void put(const Seen& seen, bool emits, int left, int across, int count, Strip& strip) {
    if (count == lanes) {
        put_block(seen.position, left, strip.position);
        put_block(seen.geometric_normal, left, strip.geometric_normal);
        put_block(seen.normal, left, strip.normal);
        put_block(seen.albedo, left, strip.albedo);
        if (emits) put_block(seen.emission, left, strip.emission);
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

// A row of a whole strip, where it begins with a line of memory.
template <class T>
HWY_INLINE void put_lines(T* to, const T (&from)[Strip::width]) {
    const hn::CappedTag<float, 16> d;
    static_assert(sizeof from % 64 == 0);
    if (reinterpret_cast<std::uintptr_t>(to) % 64 != 0) {
        stream_copy(to, from, Strip::width);
        return;
    }
    const auto* source = reinterpret_cast<const float*>(from);
    auto* target = reinterpret_cast<float*>(to);
    for (std::size_t i = 0; i < sizeof from / 4; i += hn::Lanes(d)) hn::Stream(hn::Load(d, source + i), d, target + i);
}

void store(const Strip& strip, const PixelBlocks& blocks, int left, int top, GBufferData& g) {
    const auto across = static_cast<std::size_t>(std::min(Strip::width, blocks.width() - left));
    for (int y = 0; y < std::min(Strip::height, blocks.height() - top); ++y) {
        const std::size_t first = static_cast<std::size_t>(top + y) * blocks.width() + left;
        if (across == Strip::width) {
            put_lines(&g.position[first], strip.position[y]);
            put_lines(&g.geometric_normal[first], strip.geometric_normal[y]);
            put_lines(&g.normal[first], strip.normal[y]);
            put_lines(&g.albedo[first], strip.albedo[y]);
            put_lines(&g.emission[first], strip.emission[y]);
            put_lines(&g.depth[first], strip.depth[y]);
            continue;
        }
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
    TexelLanes texels;
};

void trace(const Scene& scene, const PixelBlocks& blocks, int column, int row, Traced& t) {
    t.count = FillRays(blocks, column, row, t.rays);
    scene.rays().intersect(t.rays, t.count, Coherence::coherent, t.hits);
    for (int i = 0; i < lanes; ++i)
        if (t.hits.triangle[i] != Hit::none) scene.prefetch_triangle(t.hits.triangle[i]);
}

void see_surfaces(const Scene& scene, const CameraRays& camera, Traced& t) {
    Found found;
    Lanes level;
    find(scene, t.hits, found, t.seen);
    see(camera, t.rays, t.hits, found, t.seen, level);
    if (scene.coloured()) see_colours(scene, t.hits, t.seen);
    if (scene.emits()) see_emission(scene, t.rays, t.hits, found, t.seen);
    find_texels(scene, found.levels, found.u, found.v, level, t.texels);
}

bool any_miss(const HitPacket& hits) {
    std::uint32_t any = 0;
#pragma omp simd reduction(| : any)
    for (int i = 0; i < lanes; ++i) any |= hits.triangle[i] == Hit::none ? 1u : 0u;
    return any != 0;
}

// Memory is asked for one step ahead: triangles while rays are traced, texels while other blocks' surfaces are found.
void RenderTile(const Scene& scene, const PixelBlocks& blocks, const PixelBlocks::Tile& tile, GBufferData& g) {
    Traced traced[strip_blocks];
    for (Traced& t : traced) std::fill(&t.seen.emission[0][0], &t.seen.emission[0][0] + 3 * lanes, 0.0f);
    Strip strip{};
    for (int row = tile.top; row < tile.bottom; ++row)
        for (int column = tile.left; column < tile.right; column += strip_blocks) {
            const int wide = std::min(strip_blocks, tile.right - column), left = column * PixelBlocks::side;
            for (int b = 0; b < wide; ++b) trace(scene, blocks, column + b, row, traced[b]);
            for (int b = 0; b < wide; ++b) see_surfaces(scene, blocks.camera(), traced[b]);
            for (int b = 0; b < wide; ++b) {
                Traced& t = traced[b];
                multiply_textures(scene, t.texels, t.seen.albedo);
                if (any_miss(t.hits)) hide_misses(t.hits, t.seen);
                const int x = b * PixelBlocks::side;
                const int across = std::min(PixelBlocks::side, blocks.width() - left - x);
                put(t.seen, scene.emits(), x, across, t.count, strip);
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
HWY_EXPORT(RenderTile);

int PixelBlocks::rays(int column, int row, RayPacket& packet) const {
    return HWY_DYNAMIC_DISPATCH(FillRays)(*this, column, row, packet);
}

PixelBlocks::Tile PixelBlocks::tile(int i) const {
    const int left = i % tiles_across() * tile_width, top = i / tiles_across() * tile_height;
    return {left, top, std::min(left + tile_width, columns()), std::min(top + tile_height, rows())};
}

GBufferData render_gbuffer(const Scene& scene, const Camera& camera, int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * height;
    GBufferData g;
    for (auto* plane : {&g.position, &g.normal, &g.geometric_normal, &g.albedo, &g.emission}) plane->resize(pixels);
    g.depth.resize(pixels);
    const PixelBlocks blocks(camera, width, height);
    g.pixel_angle = blocks.camera().pixel_angle();
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < blocks.tiles(); ++i) HWY_DYNAMIC_DISPATCH(RenderTile)(scene, blocks, blocks.tile(i), g);
    return g;
}

}  // namespace lab
#endif
