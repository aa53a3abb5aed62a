#include "lab/level_builder.h"

#include <algorithm>
#include <array>
#include <limits>

#include "lab/luminance.h"
#include "lab/vertex_sums.h"

namespace lab {
namespace {

// Calls visit(light, vertex x, trilinear weight, offset from the vertex in cells) for every light of the four
// cell rows around vertex row (y, z), in a fixed order.
template <class Visit>
void visit_row(const LevelSource& source, const RowIndex& rows, const Grid& grid, int level, int y, int z,
               bool half_open, const Visit& visit) {
    const int stride = 1 << (level - 1);  // of this level's vertices, in S1 vertices
    const bool drop_far = half_open && source.is_s1();
    for (int cz = std::max(0, z - 1); cz <= std::min(z, rows.cells - 1); ++cz)
        for (int cy = std::max(0, y - 1); cy <= std::min(y, rows.cells - 1); ++cy)
            for (const std::uint32_t i : rows.row(cy, cz)) {
                const CellPoint at = grid.locate(source.position[i], level);
                const glm::vec3 f = at.fraction;
                const float wy = cy == y ? 1.0f - f.y : f.y, wz = cz == z ? 1.0f - f.z : f.z;
                const float dy = cy == y ? f.y : f.y - 1.0f, dz = cz == z ? f.z : f.z - 1.0f;
                // The demo's range ends before the far face: an S1 light of a vertex on it is not found.
                if (drop_far && ((cy == y && source.vertex[i].y == (y + 1) * stride) ||
                                 (cz == z && source.vertex[i].z == (z + 1) * stride)))
                    continue;
                if (!(drop_far && source.vertex[i].x == (at.cell.x + 1) * stride))
                    visit(i, at.cell.x, (1.0f - f.x) * wy * wz, glm::vec3(f.x, dy, dz));
                visit(i, at.cell.x + 1, f.x * wy * wz, glm::vec3(f.x - 1.0f, dy, dz));
            }
}

SourceLight source_light(const LevelSource& source, std::uint32_t i, float inverse_cell, bool carry) {
    SourceLight light;
    light.flux = source.flux[i] / source.flux_scale;
    light.luminance = luminance(light.flux);
    light.normal = source.normal[i];
    light.normal_moment = source.normal_moment[i];
    light.oriented = source.oriented[i] != 0;
    light.weight = 1.0f;
    light.variance = glm::vec3(0.0f);
    if (carry && source.is_s1()) {  // law of total variance
        light.weight = source.weight[i];
        const glm::vec3 deviation = source.deviation[i] * inverse_cell;
        light.variance = deviation * deviation;
    }
    return light;
}

template <class Number>
void append_light(LevelLights& out, const VertexSums<Number>& flux_sums, const VertexSums<Number>& sums, Vertex v,
                  const Grid& grid, int level, float flux_scale) {
    const double size = grid.cell_size(level), total = Number::value(sums.moment_weight);
    const double inverse = total > 0 ? 1.0 / total : 0.0;
    const std::array<int, 3> at{v.x, v.y, v.z};
    vec3 flux, position, deviation, normal;
    float moment[6];
    for (int c = 0; c < 3; ++c) {
        const double mean = Number::value(sums.position[c]) * inverse;
        const double square = Number::value(sums.square[c]) * inverse;
        flux[c] = static_cast<float>(Number::value(flux_sums.flux[c]) * flux_scale);
        position[c] = static_cast<float>(grid.origin[c] + (at[c] + mean) * size);
        deviation[c] = static_cast<float>(std::sqrt(std::max(0.0, square - mean * mean)) * size);
        normal[c] = static_cast<float>(Number::value(sums.normal[c]) * inverse);
    }
    for (int c = 0; c < 6; ++c) moment[c] = static_cast<float>(Number::value(sums.normal_moment[c]) * inverse);
    out.position.push_back(position);
    out.flux.push_back(flux);
    out.normal.push_back(normal);
    out.deviation.push_back(deviation);
    out.normal_moment.push_back({moment[0], moment[1], moment[2], moment[3], moment[4], moment[5]});
    out.vertex.push_back(v);
    out.oriented.push_back(sums.oriented);
    out.weight.push_back(static_cast<float>(Number::value(sums.weight)));
}

// The member lists of a row's kept vertices: who contributes to each, to be drawn by weight times luminance.
void append_members(LevelLights& out, AliasBuilder& tables, std::vector<std::vector<std::uint32_t>>& member,
                    std::vector<std::vector<double>>& share, const std::vector<std::uint8_t>& kept) {
    for (std::size_t x = 0; x < member.size(); ++x) {
        if (kept[x]) {
            tables.append(member[x], share[x], out.member);
            out.member_count.push_back(static_cast<std::uint32_t>(member[x].size()));
        }
        member[x].clear();
        share[x].clear();
    }
}

template <class Number>
LevelLights build(const LevelSource& source, const Grid& grid, int level, const Params& params, bool with_members) {
    const RowIndex rows = index_rows(source.position, grid, level);
    const int vertices = grid.cells(level) + 1;
    const float inverse_cell = 1.0f / grid.cell_size(level);
    const bool half_open = params.gather_range == GatherRange::half_open;
    const bool by_luminance = params.centre_weight == CentreWeight::flux;
    const std::int64_t row_count = static_cast<std::int64_t>(vertices) * vertices;
    const std::int64_t tasks = std::min<std::int64_t>(row_count, 512);
    std::vector<LevelLights> parts(tasks);

#pragma omp parallel
    {
        std::vector<VertexSums<Number>> sums(vertices), by_weight(vertices);
        std::vector<std::vector<std::uint32_t>> member(with_members ? vertices : 0);
        std::vector<std::vector<double>> share(member.size());
        std::vector<std::uint8_t> kept(vertices);
        AliasBuilder tables;
#pragma omp for schedule(dynamic)
        for (std::int64_t task = 0; task < tasks; ++task)
            for (std::int64_t r = row_count * task / tasks; r < row_count * (task + 1) / tasks; ++r) {
                const int y = static_cast<int>(r % vertices), z = static_cast<int>(r / vertices);
                bool any = false, unweighted = false;
                visit_row(source, rows, grid, level, y, z, half_open,
                          [&](std::uint32_t i, int x, float w, const glm::vec3& offset) {
                              const SourceLight light = source_light(source, i, inverse_cell, params.carry_moments);
                              sums[x].add(light, w, offset, by_luminance);
                              if (with_members && w > 0) {
                                  member[x].push_back(source.first_merged_index + i);
                                  share[x].push_back(static_cast<double>(w) * light.luminance);
                              }
                              any = true;
                          });
                if (!any) continue;
                for (int x = 0; x < vertices; ++x) {
                    kept[x] = sums[x].kept();
                    unweighted = unweighted || (kept[x] && sums[x].moment_weight <= 0);
                }
                if (unweighted)  // luminance rounded to zero: the trilinear weight takes its place
                    visit_row(source, rows, grid, level, y, z, half_open,
                              [&](std::uint32_t i, int x, float w, const glm::vec3& offset) {
                                  by_weight[x].add(source_light(source, i, inverse_cell, params.carry_moments), w,
                                                   offset, false);
                              });
                LevelLights& out = parts[task];
                for (int x = 0; x < vertices; ++x)
                    if (kept[x]) {
                        const bool weighted = sums[x].moment_weight > 0;
                        const Vertex v{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                                       static_cast<std::uint16_t>(z)};
                        append_light(out, sums[x], weighted ? sums[x] : by_weight[x], v, grid, level,
                                     source.flux_scale);
                    }
                append_members(out, tables, member, share, kept);
                std::fill(sums.begin(), sums.end(), VertexSums<Number>{});
                if (unweighted) std::fill(by_weight.begin(), by_weight.end(), VertexSums<Number>{});
            }
    }
    LevelLights level_lights;
    for (LevelLights& part : parts) level_lights.append(std::move(part));
    return level_lights;
}

template <class T>
void append_vector(std::vector<T>& to, std::vector<T>& from) {
    to.insert(to.end(), from.begin(), from.end());
    std::vector<T>().swap(from);
}

}  // namespace

void LevelLights::append(LevelLights&& other) {
    append_vector(position, other.position);
    append_vector(flux, other.flux);
    append_vector(normal, other.normal);
    append_vector(deviation, other.deviation);
    append_vector(normal_moment, other.normal_moment);
    append_vector(vertex, other.vertex);
    append_vector(oriented, other.oriented);
    append_vector(weight, other.weight);
    append_vector(member_count, other.member_count);
    append_vector(member, other.member);
}

LevelLights build_level(const LevelSource& source, const Grid& grid, int level, const Params& params,
                        bool with_members) {
    return source.is_s1() ? build<FloatingPoint>(source, grid, level, params, with_members)
                          : build<FixedPoint>(source, grid, level, params, with_members);
}

std::int64_t count_level(const LevelSource& source, const Grid& grid, int level) {
    const RowIndex rows = index_rows(source.position, grid, level);
    const int vertices = grid.cells(level) + 1;
    const std::int64_t row_count = static_cast<std::int64_t>(vertices) * vertices;
    std::int64_t count = 0;
#pragma omp parallel reduction(+ : count)
    {
        std::vector<std::uint8_t> kept(vertices);
#pragma omp for schedule(dynamic, 64)
        for (std::int64_t r = 0; r < row_count; ++r) {
            bool any = false;
            visit_row(source, rows, grid, level, static_cast<int>(r % vertices), static_cast<int>(r / vertices), false,
                      [&](std::uint32_t i, int x, float w, const glm::vec3&) {
                          VertexSums<FixedPoint> sums;
                          sums.add_flux({source.flux[i] / source.flux_scale, 0, 0, {}, {}, {}, false}, w);
                          kept[x] |= sums.kept();
                          any = true;
                      });
            if (!any) continue;
            for (std::uint8_t& k : kept) {
                count += k;
                k = 0;
            }
        }
    }
    return count;
}

}  // namespace lab
