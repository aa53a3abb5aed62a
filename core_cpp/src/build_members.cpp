#include "lab/build_members.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "lab/cell_keys.h"
#include "lab/coarsen.h"
#include "lab/luminance.h"

namespace lab {
namespace {

// Where a level gives its vertices' members: rows first.. of the hierarchy.
struct LevelRows {
    VertexGrid grid;
    std::size_t first;  // merged index of its first light

    LevelRows(const HierarchyView& h, const Grid& grid, int level)
        : grid(grid, level,
               h.vertex.subspan(static_cast<std::size_t>(h.offset[level]),
                                static_cast<std::size_t>(h.offset[level + 1] - h.offset[level]))),
          first(static_cast<std::size_t>(h.offset[level])) {}
};

// The lights of level `from` in the cells around a vertex, by their trilinear weights.
class MembersByCells {
  public:
    MembersByCells(const HierarchyView& h, const Grid& grid, int level, int from, bool half_open)
        : h_(h), grid_(grid), level_(level), half_open_(half_open), first_(static_cast<std::uint32_t>(h.offset[from])) {
        const auto count = static_cast<std::size_t>(h.offset[from + 1]) - first_;
        keys_ = cell_keys(h.position.subspan(first_, count), h.flux.subspan(first_, count), 0.0f, grid);
        sort_cells(keys_, grid, level);
        const int cells = grid.cells(level), shift = cell_shift(grid, level);
        row_begin_.resize(static_cast<std::size_t>(cells) * cells + 1);
        std::size_t next = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const CellKey key = keys_.key[i];
            const std::size_t row = static_cast<std::size_t>(key.cell(2, shift)) * cells + key.cell(1, shift);
            while (next <= row) row_begin_[next++] = static_cast<std::uint32_t>(i);
        }
        while (next < row_begin_.size()) row_begin_[next++] = static_cast<std::uint32_t>(count);
    }

    // Calls add(x, n) for vertices of row (y, z) and how many more members each has.
    template <class Add>
    void count(int y, int z, const Add& add) const {
        const int shift = cell_shift(grid_, level_);
        for_cell_rows(y, z, [&](int, int, std::uint32_t begin, std::uint32_t end) {
            for (std::uint32_t i = begin; i < end; ++i) {
                const int x = keys_.key[i].cell(0, shift);
                add(x, 1);
                add(x + 1, 1);
            }
        });
    }

    // Calls add(x, member, weight) for vertices of row (y, z) and each of their members.
    template <class Add>
    void visit(int y, int z, const Add& add) const {
        for_cell_rows(y, z, [&](int dy, int dz, std::uint32_t begin, std::uint32_t end) {
            const int near = dz * 4 + dy * 2;
            for (std::uint32_t i = begin; i < end; ++i) {
                const std::uint32_t light = first_ + keys_.point[i];
                Trilinear at(grid_, h_.position[light], level_);
                if (half_open_) at.end_before_far_face(h_.vertex[light], 1 << (level_ - 1));
                const double brightness = luminance(h_.flux[light]);
                add(at.cell.x, light, static_cast<double>(at.weight(near)) * brightness);
                add(at.cell.x + 1, light, static_cast<double>(at.weight(near + 1)) * brightness);
            }
        });
    }

  private:
    const HierarchyView& h_;
    Grid grid_;
    int level_;
    bool half_open_;
    std::uint32_t first_;
    CellKeys keys_;
    std::vector<std::uint32_t> row_begin_;

    // The four rows of cells around vertex row (y, z), which is on their near or far side (0 or 1).
    template <class Visit>
    void for_cell_rows(int y, int z, const Visit& visit) const {
        const int cells = grid_.cells(level_);
        for (int dz = 1; dz >= 0; --dz)
            for (int dy = 1; dy >= 0; --dy) {
                if (y < dy || z < dz || y - dy >= cells || z - dz >= cells) continue;
                const std::size_t row = static_cast<std::size_t>(z - dz) * cells + (y - dy);
                visit(dy, dz, row_begin_[row], row_begin_[row + 1]);
            }
    }
};

// The vertices of a finer level that a vertex is the sum of: see coarsen.h. Two or more levels further up, a tent is
// the sum of as many more of the finer ones, in shares that fall off linearly along each axis.
class MembersByVertices {
  public:
    MembersByVertices(const HierarchyView& h, const Grid& grid, int level, int from)
        : h_(h), finer_(h, grid, from), shift_(level - from) {}

    template <class Add>
    void count(int y, int z, const Add& add) const {
        visit_shares(y, z, [&](int x, std::uint32_t, double) { add(x, 1); });
    }

    template <class Add>
    void visit(int y, int z, const Add& add) const {
        visit_shares(y, z, [&](int x, std::uint32_t i, double share) {
            const std::size_t light = finer_.first + i;
            add(x, static_cast<std::uint32_t>(light), share * luminance(h_.flux[light]));
        });
    }

  private:
    const HierarchyView& h_;
    LevelRows finer_;
    int shift_;

    // Calls visit(x, finer vertex, share) for what row (y, z) is made of.
    template <class Visit>
    void visit_shares(int y, int z, const Visit& visit) const {
        const int reach = 1 << shift_, side = finer_.grid.side, last = (side - 1) >> shift_;
        const double step = 1.0 / reach;
        const int y0 = y << shift_, z0 = z << shift_;
        for (int fz = std::max(0, z0 - reach + 1); fz < std::min(side, z0 + reach); ++fz)
            for (int fy = std::max(0, y0 - reach + 1); fy < std::min(side, y0 + reach); ++fy) {
                const double share = (1 - std::abs(fz - z0) * step) * (1 - std::abs(fy - y0) * step);
                const std::size_t row = static_cast<std::size_t>(fz) * side + fy;
                for (std::uint32_t i = finer_.grid.row_begin[row]; i < finer_.grid.row_begin[row + 1]; ++i) {
                    const int fx = finer_.grid.vertex[i].x, x = fx >> shift_;
                    const double far = (fx & (reach - 1)) * step;
                    visit(x, i, share * (1 - far));
                    if (far > 0 && x < last) visit(x + 1, i, share * far);
                }
            }
    }
};

constexpr std::int64_t nowhere = -1;

// Calls visit(y, z, first row, last row, index by x) for the rows of vertices that have any.
template <class Visit>
void for_vertex_rows(const LevelRows& level, const Visit& visit) {
    const int side = level.grid.side;
    const std::int64_t rows = static_cast<std::int64_t>(side) * side;
    const int share = rows < 4096 ? 1 : 32;  // few rows have many members each
#pragma omp parallel
    {
        std::vector<std::int64_t> index(side + 1, nowhere);  // of the vertex at x, inside its level
        auto own = visit.fresh();
#pragma omp for schedule(dynamic, share)
        for (std::int64_t row = 0; row < rows; ++row) {
            const std::uint32_t begin = level.grid.row_begin[row], end = level.grid.row_begin[row + 1];
            if (begin == end) continue;
            for (std::uint32_t i = begin; i < end; ++i) index[level.grid.vertex[i].x] = i;
            own(static_cast<int>(row % side), static_cast<int>(row / side), begin, end, index);
            for (std::uint32_t i = begin; i < end; ++i) index[level.grid.vertex[i].x] = nowhere;
        }
    }
}

template <class Members>
struct CountRows {
    const Members& members;
    std::int64_t* count;  // of each vertex

    CountRows fresh() const { return *this; }
    void operator()(int y, int z, std::uint32_t, std::uint32_t, const std::vector<std::int64_t>& index) {
        members.count(y, z, [&](int x, int more) {
            if (index[x] != nowhere) count[index[x]] += more;
        });
    }
};

template <class Members>
struct FillRows {
    const Members& members;
    const std::int64_t* offset;  // of each vertex
    AliasSlot* slot;
    std::vector<std::int64_t> next;
    std::vector<double> weight;
    AliasTables tables;

    FillRows fresh() const { return *this; }
    void operator()(int y, int z, std::uint32_t begin, std::uint32_t end, const std::vector<std::int64_t>& index) {
        const std::int64_t first = offset[begin];
        next.assign(offset + begin, offset + end);
        weight.resize(static_cast<std::size_t>(offset[end] - first));
        members.visit(y, z, [&](int x, std::uint32_t member, double share) {
            if (index[x] == nowhere) return;
            const std::int64_t at = next[static_cast<std::size_t>(index[x] - begin)]++;
            slot[at].own = member;
            weight[static_cast<std::size_t>(at - first)] = share;
        });
        for (std::uint32_t i = begin; i < end; ++i) {
            const auto count = static_cast<std::size_t>(offset[i + 1] - offset[i]);
            tables.fill({slot + offset[i], count}, {weight.data() + (offset[i] - first), count});
        }
    }
};

// Calls use(members) with where the members of a level's vertices come from.
template <class Use>
void with_members(const HierarchyView& h, const Grid& grid, int level, const Params& params, const Use& use) {
    const bool half_open = params.construction == Construction::gather && params.gather_range == GatherRange::half_open;
    if (level == 1)
        use(MembersByCells(h, grid, level, 0, false));
    else if (half_open || (level == 2 && params.construction == Construction::gather))
        use(MembersByCells(h, grid, level, 1, half_open));
    else
        use(MembersByVertices(h, grid, level, std::min(level - 1, 2)));
}

}  // namespace

MemberData build_members(const HierarchyView& h, const Params& params) {
    const std::size_t inputs = h.input_index.size();
    Grid grid;
    grid.origin = h.origin;
    grid.top = h.top();
    grid.top_size = h.cell_size[static_cast<std::size_t>(grid.top)];
    MemberData out;
    out.offset.resize(h.position.size() - inputs + 1);
    std::fill(out.offset.begin(), out.offset.end(), 0);
    for (int level = 1; level <= grid.top; ++level) {
        const LevelRows rows(h, grid, level);
        if (rows.grid.vertex.empty()) continue;
        std::int64_t* offset = out.offset.data() + (rows.first - inputs);
        with_members(h, grid, level, params, [&]<class Members>(const Members& members) {
            for_vertex_rows(rows, CountRows<Members>{members, offset + 1});
            std::partial_sum(offset, offset + rows.grid.vertex.size() + 1, offset);
            const std::int64_t end = offset[rows.grid.vertex.size()];
            if (level == 1) out.slot.reserve(static_cast<std::size_t>(end) * 7 / 4);
            out.slot.resize(static_cast<std::size_t>(end));
            for_vertex_rows(rows, FillRows<Members>{members, offset, out.slot.data(), {}, {}, {}});
        });
    }
    return out;
}

}  // namespace lab
