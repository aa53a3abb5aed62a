#include "lab/level_builder.h"

#include <algorithm>
#include <numeric>

namespace lab {
namespace {

constexpr std::uint32_t block = 128;  // lights prepared together: their terms stay in the first cache

template <class Number>
class LayerSweep {
  public:
    using Rows = Buffer<VertexRow<Number>>;

    LayerSweep(const LevelSource& source, const KeyedPoints& points, const TermSettings& settings,
               const LevelTarget& target)
        : source_(source),
          points_(points),
          settings_(settings),
          target_(target),
          layers_(points, settings.grid, settings.level),
          terms_(block) {}

    // Builds vertex layers first..last - 1; `before`: how many kept vertices come before each layer.
    void sweep(int first, int last, std::span<const std::uint32_t> before) {
        for (int z = first - 1; z < last; ++z) {  // cell layer z lies between the vertex layers z and z + 1
            Rows *near = z >= first ? &rows_[z & 1] : nullptr, *far = nullptr;
            if (z + 1 < last) {
                layers_.open(z + 1);
                far = &rows_[(z + 1) & 1];
                far->assign(layers_.count(z + 1), {});
            }
            add_layer(z, near, far, settings_.by_luminance);
            if (near && !near->empty()) finish(z, *near, before[z]);
        }
    }

  private:
    const LevelSource& source_;
    const KeyedPoints& points_;
    const TermSettings& settings_;
    const LevelTarget& target_;
    VertexLayers layers_;
    Rows rows_[2];  // of vertex layers, in turn
    std::vector<LightTerms> terms_;
    std::vector<std::uint32_t> index_;
    std::vector<CellRun<Number>> runs_;
    std::vector<Vertex> vertices_;
    VertexRow<Number> lost_{};  // takes what nobody owns or keeps

    // Adds the lights of cell layer z to the rows of its vertices, which are those of vertex layers z and z + 1.
    void add_layer(int z, Rows* near, Rows* far, bool by_luminance) {
        const auto [begin, end] = points_.keys.range(settings_.grid, settings_.level, z);
        const int shift = cell_shift(settings_.grid, settings_.level);
        TermSettings settings = settings_;
        settings.by_luminance = by_luminance;
        for (std::uint32_t start = begin; start < end; start += block) {
            const std::uint32_t stop = std::min(end, start + block);
            index_.clear();
            runs_.clear();
            for (std::uint32_t i = start; i < stop; ++i) {
                index_.push_back(points_.point(i));
                const CellKey key = points_.keys.key[i];
                const int x = key.cell(0, shift), y = key.cell(1, shift);
                if (i > start) {
                    const CellKey last = points_.keys.key[i - 1];
                    if (last.cell(0, shift) == x && last.cell(1, shift) == y) {
                        ++runs_.back().end;
                        continue;
                    }
                }
                CellRun<Number> run{i - start, i - start + 1, {}};
                find_rows(z, x, y, near, run.row);
                find_rows(z + 1, x, y, far, run.row + 4);
                runs_.push_back(run);
            }
            prepare_terms(source_, settings, index_, terms_.data());
            add_cells(terms_.data(), runs_);
        }
    }

    // The rows of a cell's four corners in vertex layer z.
    void find_rows(int z, int x, int y, Rows* rows, VertexRow<Number>** found) {
        for (int dy = 0; dy < 2; ++dy)
            for (int dx = 0; dx < 2; ++dx)
                *found++ =
                    rows && layers_.kept(z, x + dx, y + dy) ? rows->data() + layers_.rank(z, x + dx, y + dy) : &lost_;
    }

    void finish(int z, Rows& rows, std::uint32_t before) {
        const auto unweighted = [](const VertexRow<Number>& row) { return row.sum[column::moment_weight] <= 0; };
        if (std::any_of(rows.begin(), rows.end(), unweighted)) {
            // Luminance rounded to zero: the trilinear weight takes its place.
            Rows by_weight(rows.size(), VertexRow<Number>{});
            add_layer(z - 1, nullptr, &by_weight, false);
            add_layer(z, &by_weight, nullptr, false);
            for (std::size_t i = 0; i < rows.size(); ++i)
                if (unweighted(rows[i])) rows[i] = by_weight[i];
        }
        vertices_.clear();
        layers_.for_each(z, [&](int x, int y) {
            vertices_.push_back(
                {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(z)});
        });
        finish_lights(rows, vertices_, settings_, source_.flux_scale, target_.lights, target_.first + before,
                      target_.weight ? target_.weight->data() + before : nullptr);
        if constexpr (std::is_same_v<Number, FloatingPoint>)
            if (target_.rows) std::copy(rows.begin(), rows.end(), target_.rows->begin() + before);
        if constexpr (std::is_same_v<Number, FixedPoint>)
            if (target_.fixed_rows) std::copy(rows.begin(), rows.end(), target_.fixed_rows->begin() + before);
    }
};

template <class Number>
void build(const LevelSource& source, const KeyedPoints& points, std::span<const std::uint32_t> count,
           const TermSettings& settings, const LevelTarget& target) {
    std::vector<std::uint32_t> before(count.size());
    std::exclusive_scan(count.begin(), count.end(), before.begin(), 0u);
    const std::vector<int> cuts = cut_layers(points.keys, settings.grid, settings.level);
#pragma omp parallel
    {
        LayerSweep<Number> sweep(source, points, settings, target);
#pragma omp for schedule(dynamic, 1)
        for (std::size_t task = 1; task < cuts.size(); ++task) sweep.sweep(cuts[task - 1], cuts[task], before);
    }
}

}  // namespace

void build_level(const LevelSource& source, const KeyedPoints& points, std::span<const std::uint32_t> count,
                 const TermSettings& settings, const LevelTarget& target) {
    if (source.s1())
        build<FloatingPoint>(source, points, count, settings, target);
    else
        build<FixedPoint>(source, points, count, settings, target);
}

}  // namespace lab
