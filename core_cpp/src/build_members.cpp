#include "lab/build_members.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "lab/coarsen.h"
#include "lab/luminance.h"
#include "lab/member_cells.h"

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

// Members by vertices: those of a finer level that a vertex is the sum of, see coarsen.h. Two or more levels further
// up, a tent is the sum of as many more of the finer ones, in shares that fall off linearly along each axis.
class MemberVertices {
  public:
    MemberVertices(const HierarchyView& h, const Grid& grid, int level, int from)
        : h_(h), finer_(h, grid, from), shift_(level - from) {}

    void count(const VertexLine& line, std::int64_t* members) const {
        const ByPlace place(line);
        std::fill_n(members, line.vertex.size(), 0);
        visit_shares(line, [&](int x, std::uint32_t, double) {
            if (const int at = place.of(x); at >= 0) ++members[at];
        });
    }

    // Merged indices and weights, those of one vertex after the other; `offset`: where each vertex' begin.
    void fill(const VertexLine& line, const std::int64_t* offset, std::uint32_t* item, double* weight) const {
        const ByPlace place(line);
        std::vector<std::int64_t> next(line.vertex.size());
        for (std::size_t v = 0; v < next.size(); ++v) next[v] = offset[v] - offset[0];
        visit_shares(line, [&](int x, std::uint32_t i, double share) {
            const int vertex = place.of(x);
            if (vertex < 0) return;
            const std::int64_t at = next[vertex]++;
            const std::size_t light = finer_.first + i;
            item[at] = static_cast<std::uint32_t>(light);
            weight[at] = share * luminance(h_.flux[light]);
        });
    }

  private:
    // Which vertex of a line lies at x, -1: none.
    class ByPlace {
      public:
        explicit ByPlace(const VertexLine& line) : at_(line.vertex.back().x + 1, -1) {
            for (std::size_t v = 0; v < line.vertex.size(); ++v) at_[line.vertex[v].x] = static_cast<int>(v);
        }
        int of(int x) const { return x < static_cast<int>(at_.size()) ? at_[x] : -1; }

      private:
        std::vector<int> at_;
    };

    const HierarchyView& h_;
    LevelRows finer_;
    int shift_;

    // Calls visit(x, finer vertex, share) for what a line is made of.
    template <class Visit>
    void visit_shares(const VertexLine& line, const Visit& visit) const {
        const int reach = 1 << shift_, side = finer_.grid.side, last = (side - 1) >> shift_;
        const double step = 1.0 / reach;
        const int y0 = line.y << shift_, z0 = line.z << shift_;
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

// Calls work(line, number of its first vertex) of a copy of `fresh` that each thread has, for every row that has any.
template <class Work>
void for_lines(const LevelRows& level, const Work& fresh) {
    const int side = level.grid.side;
    const std::int64_t rows = static_cast<std::int64_t>(side) * side;
    const int share = rows < 4096 ? 1 : 32;  // few rows have many members each
#pragma omp parallel
    {
        Work work = fresh;
#pragma omp for schedule(dynamic, share)
        for (std::int64_t row = 0; row < rows; ++row) {
            const std::uint32_t begin = level.grid.row_begin[row], end = level.grid.row_begin[row + 1];
            if (begin == end) continue;
            work({static_cast<int>(row % side), static_cast<int>(row / side),
                  level.grid.vertex.subspan(begin, end - begin)},
                 begin);
        }
    }
}

// Makes the tables of a line.
template <class Members>
struct FillLine {
    const Members& members;
    const std::int64_t* offset;  // of each vertex of the level
    AliasSlot* slot;
    std::vector<std::uint32_t> item;
    std::vector<double> weight;
    AliasTables tables;

    void operator()(const VertexLine& line, std::uint32_t first) {
        const std::span begins(offset + first, line.vertex.size() + 1);
        const auto count = static_cast<std::size_t>(begins.back() - begins.front());
        item.resize(count + MemberCells::vector);
        weight.resize(count + MemberCells::vector);
        members.fill(line, begins.data(), item.data(), weight.data());
        tables.fill({slot + begins.front(), count}, begins, item, weight);
    }
};

// Calls use(members) with where the members of a level's vertices come from.
template <class Use>
void with_members(const HierarchyView& h, const Grid& grid, int level, const Params& params, const Use& use) {
    const bool half_open = params.construction == Construction::gather && params.gather_range == GatherRange::half_open;
    if (level == 1)
        use(MemberCells(h, grid, level, 0, false));
    else if (half_open || (level == 2 && params.construction == Construction::gather))
        use(MemberCells(h, grid, level, 1, half_open));
    else
        use(MemberVertices(h, grid, level, std::min(level - 1, 2)));
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
            for_lines(rows,
                      [&](const VertexLine& line, std::uint32_t first) { members.count(line, offset + 1 + first); });
            std::partial_sum(offset, offset + rows.grid.vertex.size() + 1, offset);
            const std::int64_t end = offset[rows.grid.vertex.size()];
            if (level == 1) out.slot.reserve(static_cast<std::size_t>(end) * 7 / 4);
            out.slot.resize(static_cast<std::size_t>(end));
            for_lines(rows, FillLine<Members>{members, offset, out.slot.data(), {}, {}, {}});
        });
    }
    return out;
}

}  // namespace lab
