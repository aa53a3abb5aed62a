#include "lab/build_hierarchy.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "lab/grid.h"
#include "lab/level_builder.h"

namespace lab {
namespace {

// S0 in grid order of level 1's cells (ties in input order), so that neighbours in space are neighbours in
// memory.
std::vector<std::uint32_t> grid_order(std::span<const vec3> positions, const Grid& grid) {
    RowIndex rows = index_rows(positions, grid, 1);
    const auto row_count = static_cast<std::int64_t>(rows.begin.size()) - 1;
#pragma omp parallel for schedule(dynamic, 256)
    for (std::int64_t r = 0; r < row_count; ++r)
        std::stable_sort(rows.order.begin() + rows.begin[r], rows.order.begin() + rows.begin[r + 1],
                         [&](std::uint32_t a, std::uint32_t b) {
                             return grid.locate(positions[a], 1).cell.x < grid.locate(positions[b], 1).cell.x;
                         });
    return std::move(rows.order);
}

LevelSource sorted_source(const LightsView& lights, std::span<const std::uint32_t> order) {
    LevelSource s0;
    const std::size_t n = order.size();
    s0.position.resize(n);
    s0.flux.resize(n);
    s0.normal.resize(n);
    s0.normal_moment.resize(n);
    s0.oriented.resize(n);
    float largest = 0.0f;
    for (std::size_t i = 0; i < n; ++i) {
        const vec3 normal = lights.normal[order[i]], flux = lights.flux[order[i]];
        const bool oriented = normal != vec3(0.0f);
        s0.position[i] = lights.position[order[i]];
        s0.flux[i] = flux;
        s0.normal[i] = normal;
        s0.normal_moment[i] = oriented ? Symmetric{normal.x * normal.x, normal.y * normal.y, normal.z * normal.z,
                                                   normal.x * normal.y, normal.x * normal.z, normal.y * normal.z}
                                       : Symmetric{1.0f / 3, 1.0f / 3, 1.0f / 3, 0, 0, 0};
        s0.oriented[i] = oriented;
        largest = std::max(largest, std::max(flux.x, std::max(flux.y, flux.z)));
    }
    int exponent = 0;
    std::frexp(largest, &exponent);  // largest < 2^exponent
    s0.flux_scale = largest > 0 ? std::ldexp(1.0f, std::min(exponent, 127)) : 1.0f;
    return s0;
}

// Raises the number of levels while |S1| stays under half of the lights, and stops at the first failure.
int auto_levels(const LevelSource& s0, Grid grid) {
    const auto lights = static_cast<std::int64_t>(s0.position.size());
    int levels = 1;
    while (levels < max_levels) {
        grid.top = levels + 1;
        const std::int64_t side = grid.cells(1) + 1;
        const bool surely = 2 * side * side * side < lights;  // even if every vertex were kept
        if (!surely && 2 * count_level(s0, grid, 1) >= lights) break;
        ++levels;
    }
    return levels;
}

int demo_levels(std::size_t lights) {
    int levels = 1;
    while (levels < max_levels && std::pow(8.0, levels) <= 10.0 * static_cast<double>(lights)) ++levels;
    return levels;
}

void append_level(HierarchyData& out, LevelLights&& level) {
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(out.position, level.position);
    append(out.flux, level.flux);
    append(out.normal, level.normal);
    append(out.normal_moment, level.normal_moment);
    append(out.deviation, level.deviation);
    append(out.vertex, level.vertex);
    append(out.oriented, level.oriented);
    append(out.member, level.member);
    for (const std::uint32_t count : level.member_count) out.member_offset.push_back(out.member_offset.back() + count);
    out.offset.push_back(static_cast<std::int64_t>(out.position.size()));
}

void append_input_lights(HierarchyData& out, const LevelSource& s0, const Grid& grid) {
    LevelLights level;
    level.position = s0.position;
    level.flux = s0.flux;
    level.normal = s0.normal;
    level.normal_moment = s0.normal_moment;
    level.oriented = s0.oriented;
    level.deviation.assign(s0.position.size(), vec3(0.0f));
    for (const vec3& p : s0.position) {
        const glm::ivec3 cell = grid.locate(p, 1).cell;
        level.vertex.push_back({static_cast<std::uint16_t>(cell.x), static_cast<std::uint16_t>(cell.y),
                                static_cast<std::uint16_t>(cell.z)});
    }
    append_level(out, std::move(level));
}

}  // namespace

HierarchyData build_hierarchy(const LightsView& lights, const Params& params, bool with_members) {
    Grid grid = make_grid(lights.position, params.bounds_scale);
    std::vector<std::uint32_t> order(lights.position.size());
    std::iota(order.begin(), order.end(), 0u);
    if (params.levels == levels_auto)
        grid.top = auto_levels(sorted_source(lights, order), grid);
    else
        grid.top = params.levels == levels_demo ? demo_levels(order.size()) : params.levels;

    HierarchyData out;
    out.input_index = order = grid_order(lights.position, grid);
    const LevelSource s0 = sorted_source(lights, order);
    out.origin = grid.origin;
    out.offset = {0};
    out.member_offset = {0};
    for (int level = 0; level <= grid.top; ++level)
        out.cell_size.push_back(level == 0 ? grid.cell_size(1) / 2 : grid.cell_size(level));

    append_input_lights(out, s0, grid);
    LevelLights level1 = build_level(s0, grid, 1, params, with_members);
    LevelSource s1;
    s1.position = level1.position;
    s1.flux = level1.flux;
    s1.normal = level1.normal;
    s1.normal_moment = level1.normal_moment;
    s1.deviation = level1.deviation;
    s1.weight = level1.weight;
    s1.vertex = level1.vertex;
    s1.oriented = level1.oriented;
    s1.flux_scale = s0.flux_scale;
    s1.first_merged_index = static_cast<std::uint32_t>(order.size());
    append_level(out, std::move(level1));

    const LevelSource& source = params.construction == Construction::gather ? s1 : s0;
    for (int level = 2; level <= grid.top && !s1.position.empty(); ++level)
        append_level(out, build_level(source, grid, level, params, with_members));
    while (out.offset.size() <= static_cast<std::size_t>(grid.top) + 1)
        out.offset.push_back(out.offset.back());  // all lights black: every level is empty
    if (!with_members) out.member_offset.clear();
    return out;
}

}  // namespace lab
