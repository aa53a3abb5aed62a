#include "lab/build_hierarchy.h"

#include <algorithm>
#include <cmath>

#include "lab/coarsen.h"
#include "lab/grid.h"
#include "lab/level_builder.h"
#include "lab/s1_sums.h"
#include "lab/select.h"

namespace lab {
namespace {

// A power of two above every flux.
float flux_scale(std::span<const vec3> flux) {
    const auto count = static_cast<std::int64_t>(flux.size());
    float largest = 0.0f;
#pragma omp parallel for simd reduction(max : largest)
    for (std::int64_t i = 0; i < count; ++i) largest = larger(largest, larger(flux[i].x, larger(flux[i].y, flux[i].z)));
    int exponent = 0;
    std::frexp(largest, &exponent);  // largest < 2^exponent
    return largest > 0 ? std::ldexp(1.0f, std::min(exponent, 127)) : 1.0f;
}

// The most levels for which |S1| stays under half of the lights with any fewer levels too, and S1's counts for them: as
// if the number was raised from 1 to the first failure. VertexCount::bound makes most of these trials needless.
VertexCount choose_levels(const KeyedPoints& lights, Grid& grid) {
    const std::size_t count = lights.position.size(), most = (count + 1) / 2;  // half or more of the lights
    const auto tried = [&](int levels) {
        grid.top = levels;
        return levels == 1 ? count_vertices(lights, grid, 1) : count_vertices(lights, grid, 1, most);
    };
    // Lights lie on surfaces: S1 is about five times the square of the number of cells along an axis.
    int levels = 1;
    while (levels < max_levels && std::size_t{5} << (2 * levels) < most) ++levels;
    VertexCount found = tried(levels);
    while (levels > 1 && found.bound >= most) found = tried(--levels);
    while (levels < max_levels) {
        VertexCount more = tried(levels + 1);
        if (more.total >= most) break;
        found = std::move(more);
        ++levels;
    }
    grid.top = levels;
    return found;
}

int demo_levels(std::size_t lights) {
    int levels = 1;
    while (levels < max_levels && std::pow(8.0, levels) <= 10.0 * static_cast<double>(lights)) ++levels;
    return levels;
}

// S0 in grid order of level 1's cells (ties in input order), so that neighbours in space are neighbours in memory.
void write_input_lights(const LightsView& in, const CellKeys& keys, const Grid& grid, LightArrays& out) {
    const auto count = static_cast<std::int64_t>(keys.key.size());
    const int shift = cell_shift(grid, 1);
    constexpr std::int64_t ahead = 24;  // input lights are read in random order
#pragma omp parallel for schedule(static)
    for (std::int64_t i = 0; i < count; ++i) {
        const std::uint32_t soon = keys.point[std::min(i + ahead, count - 1)];
        __builtin_prefetch(&in.position[soon]);
        __builtin_prefetch(&in.flux[soon]);
        __builtin_prefetch(&in.normal[soon]);
        const std::uint32_t light = keys.point[i];
        const vec3 n = in.normal[light];
        const bool oriented = n != vec3(0.0f);
        out.position[i] = in.position[light];
        out.flux[i] = in.flux[light];
        out.normal[i] = n;
        out.deviation[i] = vec3(0.0f);
        out.normal_moment[i] = oriented ? Symmetric{n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z}
                                        : Symmetric{1.0f / 3, 1.0f / 3, 1.0f / 3, 0, 0, 0};
        out.oriented[i] = oriented;
        const CellKey key = keys.key[i];
        out.vertex[i] = {static_cast<std::uint16_t>(key.cell(0, shift)), static_cast<std::uint16_t>(key.cell(1, shift)),
                         static_cast<std::uint16_t>(key.cell(2, shift))};
    }
}

// Rows that the levels from 2 on will hardly exceed: room to grow without moving what is there.
std::size_t room_for_coarse_levels(const Grid& grid, std::size_t s1) {
    std::size_t all = 0;
    for (int level = 2; level <= grid.top; ++level) {
        const auto side = static_cast<std::size_t>(grid.cells(level)) + 1;
        all += side * side * side;
    }
    return std::min(all, s1) + 1;
}

class Builder {
  public:
    Builder(const LightsView& in, const Params& params, Buffer<VertexRow<FixedPoint>>* s1_rows = nullptr)
        : params_(params), scale_(flux_scale(in.flux)), grid_(make_grid(in.position, params.bounds_scale)) {
        keys_ = cell_keys(in.position, in.flux, dim_flux * scale_, grid_);
        const KeyedPoints lights{keys_, in.position, in.flux, {}, scale_, false, true};
        const std::size_t count = in.position.size();
        VertexCount kept;
        if (params.levels == levels_auto) {
            kept = choose_levels(lights, grid_);
        } else {
            grid_.top = params.levels == levels_demo ? demo_levels(count) : params.levels;
            kept = count_vertices(lights, grid_, 1);
        }
        sort_cells(keys_, grid_, 1);
        out_.lights.reserve(count + kept.total + room_for_coarse_levels(grid_, kept.total));
        out_.lights.resize(count + kept.total);
        write_input_lights(in, keys_, grid_, out_.lights);
        out_.offset = {0, static_cast<std::int64_t>(count)};
        s1_weight_.resize(kept.total);
        if (s1_rows) s1_rows->resize(kept.total);
        add_level(1, kept, &s1_weight_, s1_rows);
    }

    HierarchyData build() {
        const bool gather = params_.construction == Construction::gather;
        const bool coarse_from_fine = gather && params_.gather_range == GatherRange::inclusive;
        const std::size_t s1_end = out_.lights.size();
        Buffer<VertexRow<FloatingPoint>> sums;
        for (int level = 2; level <= grid_.top && s1_end > inputs(); ++level) {
            if (!gather)
                scatter_level(level);
            else if (level == 2 || !coarse_from_fine)
                gather_level(level, s1_end, coarse_from_fine ? &sums : nullptr);
            else {
                sums = coarsen(sums, static_cast<std::size_t>(out_.offset[level - 1]), settings(level), scale_,
                               out_.lights);
                out_.offset.push_back(static_cast<std::int64_t>(out_.lights.size()));
            }
        }
        while (out_.offset.size() <= static_cast<std::size_t>(grid_.top) + 1)
            out_.offset.push_back(out_.offset.back());  // all lights black: every level is empty
        out_.origin = grid_.origin;
        for (int level = 0; level <= grid_.top; ++level)
            out_.cell_size.push_back(level == 0 ? grid_.cell_size(1) / 2 : grid_.cell_size(level));
        out_.input_index = std::move(keys_.point);
        return std::move(out_);
    }

  private:
    const Params& params_;
    float scale_;
    Grid grid_;
    CellKeys keys_;  // of S0
    Buffer<float> s1_weight_;
    HierarchyData out_;
    using Rows = Buffer<VertexRow<FloatingPoint>>;

    std::size_t inputs() const { return static_cast<std::size_t>(out_.offset[1]); }

    TermSettings settings(int level) const {
        return {grid_, level, params_.carry_moments, params_.centre_weight == CentreWeight::flux};
    }

    // Input lights lie in the order of their keys from now on.
    KeyedPoints input_points() const {
        return {keys_, {out_.lights.position.data(), inputs()}, {out_.lights.flux.data(), inputs()}, {}, scale_, false,
                false};
    }

    void scatter_level(int level) {
        const VertexCount kept = count_vertices(input_points(), grid_, level);
        out_.lights.resize(out_.lights.size() + kept.total);
        add_level(level, kept, nullptr);
    }

    // Of the input lights, into the last rows.
    void add_level(int level, const VertexCount& kept, Buffer<float>* weight,
                   Buffer<VertexRow<FixedPoint>>* rows = nullptr) {
        build_level({out_.lights, 0, inputs(), {}, scale_, false}, input_points(), kept.of_layer, settings(level),
                    {out_.lights, out_.lights.size() - kept.total, weight, nullptr, rows});
        out_.offset.push_back(static_cast<std::int64_t>(out_.lights.size()));
    }

    void gather_level(int level, std::size_t s1_end, Rows* sums) {
        const std::size_t first = inputs(), count = s1_end - first;
        const bool half_open = params_.gather_range == GatherRange::half_open;
        CellKeys keys = cell_keys({out_.lights.position.data() + first, count},
                                  {out_.lights.flux.data() + first, count}, 0.0f, grid_);
        sort_cells(keys, grid_, level);
        const auto points = [&] {
            return KeyedPoints{keys,
                               {out_.lights.position.data() + first, count},
                               {out_.lights.flux.data() + first, count},
                               {out_.lights.vertex.data() + first, half_open ? count : 0},
                               scale_,
                               true,
                               true};
        };
        const VertexCount kept = count_vertices(points(), grid_, level);
        const std::size_t end = out_.lights.size();
        out_.lights.resize(end + kept.total);
        if (sums) sums->resize(kept.total);
        const LevelSource source{out_.lights, first, count, s1_weight_, scale_, half_open};
        build_level(source, points(), kept.of_layer, settings(level), {out_.lights, end, nullptr, sums});
        out_.offset.push_back(static_cast<std::int64_t>(out_.lights.size()));
    }
};

}  // namespace

HierarchyData build_hierarchy(const LightsView& lights, const Params& params) {
    return Builder(lights, params).build();
}

std::vector<std::int64_t> s1_sums(const LightsView& lights, const Params& params) {
    Buffer<VertexRow<FixedPoint>> rows;
    const Builder built(lights, params, &rows);
    std::vector<std::int64_t> sums;
    for (const VertexRow<FixedPoint>& row : rows) sums.insert(sums.end(), std::begin(row.sum), std::end(row.sum));
    return sums;
}

}  // namespace lab
