#include "lab/alias_table.h"

#include <numeric>

namespace lab {

void AliasTables::fill(std::span<AliasSlot> table, std::span<double> weight) {
    const auto count = static_cast<std::uint32_t>(table.size());
    const double total = std::accumulate(weight.begin(), weight.end(), 0.0);
    const double scale = total > 0 ? static_cast<double>(count) / total : 0.0;
    // Nothing below branches on a weight: which is above the mean cannot be foretold.
    poor_.resize(count + 1);
    rich_.resize(count + 1);
    std::uint32_t poor = 0, rich = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        weight[i] *= scale;
        table[i].other = table[i].own;
        table[i].keep = 0;
        poor_[poor] = i;
        rich_[rich] = i;
        const bool less = weight[i] < 1;
        poor += less;
        rich += !less;
    }
    // Each slot that is not full is filled up by an item that has more than its own.
    std::uint32_t from = 0;
    while (poor > 0 && rich > 0) {
        from = rich_[rich - 1];
        const std::uint32_t to = poor_[--poor];
        table[to].other = table[from].own;
        table[to].keep = static_cast<std::uint32_t>(weight[to] * (0x1p32 - 1));
        weight[from] -= 1 - weight[to];
        const bool less = weight[from] < 1;
        poor_[poor] = from;
        poor += less;
        rich -= less;
    }
    // What rounding leaves over is full; but nothing may come from an item without weight.
    for (std::uint32_t i = 0; i < poor; ++i)
        if (total > 0 && !(weight[poor_[i]] > 0)) table[poor_[i]].other = table[from].own;
}

}  // namespace lab
