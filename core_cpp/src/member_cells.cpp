#include "lab/member_cells.h"

#include <algorithm>

#include "lab/cell_keys.h"
#include "lab/luminance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/member_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

void FillLine(const MemberCells& m, const VertexLine& line, std::uint32_t* item, double* weight) {
    const hn::CappedTag<double, MemberCells::vector> d;
    const hn::Rebind<float, decltype(d)> df;
    const hn::Rebind<std::uint32_t, decltype(d)> du;
    const auto step = static_cast<std::uint32_t>(hn::Lanes(d));
    std::size_t at = 0;
    for_cells_around(
        m, line,
        [&](std::uint32_t begin, std::uint32_t end, int far_x, int far_y, int far_z) HWY_ATTR {
            const float *const fx = m.factor[far_x][0].data(), *const fy = m.factor[far_y][1].data(),
                               *const fz = m.factor[far_z][2].data();
            for (std::uint32_t i = begin; i < end; i += step) {  // what is written past the end is written again
                const auto trilinear =
                    hn::Mul(hn::Mul(hn::LoadU(df, fx + i), hn::LoadU(df, fy + i)), hn::LoadU(df, fz + i));
                const auto brightness = hn::PromoteTo(d, hn::LoadU(df, m.brightness.data() + i));
                hn::StoreU(hn::Mul(hn::PromoteTo(d, trilinear), brightness), d, weight + at + (i - begin));
                hn::StoreU(hn::LoadU(du, m.light.data() + i), du, item + at + (i - begin));
            }
            at += end - begin;
        },
        [] {});
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {

HWY_EXPORT(FillLine);

MemberCells::MemberCells(const HierarchyView& h, const Grid& grid, int level, int from, bool half_open)
    : cells(grid.cells(level)) {
    const auto first = static_cast<std::size_t>(h.offset[from]),
               count = static_cast<std::size_t>(h.offset[from + 1]) - first;
    CellKeys keys;
    const bool in_order = from == 0 && level == 1;  // S0 lies in the order of level 1's cells
    if (!in_order) {
        keys = cell_keys(h.position.subspan(first, count), h.flux.subspan(first, count), 0.0f, grid);
        sort_cells(keys, grid, level);
    }
    light.resize(count + vector);
    brightness.resize(count + vector);
    for (auto& side : factor)
        for (Buffer<float>& axis : side) axis.resize(count + vector);
    const auto lights = static_cast<std::int64_t>(count);
#pragma omp parallel for schedule(static)
    for (std::int64_t i = 0; i < lights; ++i) {
        const std::size_t of = first + (in_order ? static_cast<std::size_t>(i) : keys.point[i]);
        light[i] = static_cast<std::uint32_t>(of);
        brightness[i] = luminance(h.flux[of]);
        Trilinear at(grid, h.position[of], level);
        if (half_open) at.end_before_far_face(h.vertex[of], 1 << (level - 1));
        for (int side = 0; side < 2; ++side)
            for (int axis = 0; axis < 3; ++axis) factor[side][axis][i] = at.factor[side][axis];
    }
    if (in_order) {
        find_cells(lights, [&](std::int64_t i) {
            const Vertex v = h.vertex[i];  // an input light's is its cell
            return CellPlace{v.x, v.y, v.z};
        });
    } else {
        const int shift = cell_shift(grid, level);
        find_cells(lights, [&](std::int64_t i) {
            const CellKey key = keys.key[i];
            return CellPlace{key.cell(0, shift), key.cell(1, shift), key.cell(2, shift)};
        });
    }
}

template <class PlaceOf>
void MemberCells::find_cells(std::int64_t lights, const PlaceOf& place_of) {
    const auto begins = [&](std::int64_t i) { return i == 0 || !(place_of(i) == place_of(i - 1)); };
    std::size_t count = 0;
#pragma omp parallel for schedule(static) reduction(+ : count)
    for (std::int64_t i = 0; i < lights; ++i) count += begins(i);
    cell.resize(count + 1);
    row_begin.resize(static_cast<std::size_t>(cells) * cells + 1);
    std::size_t next = 0, row = 0;
    for (std::int64_t i = 0; i < lights; ++i) {
        if (!begins(i)) continue;
        const CellPlace at = place_of(i);
        for (; row <= static_cast<std::size_t>(at.z) * cells + at.y; ++row)
            row_begin[row] = static_cast<std::uint32_t>(next);
        cell[next++] = {static_cast<std::uint32_t>(at.x), static_cast<std::uint32_t>(i)};
    }
    for (; row < row_begin.size(); ++row) row_begin[row] = static_cast<std::uint32_t>(next);
    cell[next] = {0, static_cast<std::uint32_t>(lights)};
}

void MemberCells::count(const VertexLine& line, std::int64_t* members) const {
    std::int64_t sum = 0;
    for_cells_around(
        *this, line, [&](std::uint32_t begin, std::uint32_t end, int, int, int) { sum += end - begin; },
        [&] {
            *members++ = sum;
            sum = 0;
        });
}

void MemberCells::fill(const VertexLine& line, const std::int64_t*, std::uint32_t* item, double* weight) const {
    HWY_DYNAMIC_DISPATCH(FillLine)(*this, line, item, weight);
}

}  // namespace lab
#endif
