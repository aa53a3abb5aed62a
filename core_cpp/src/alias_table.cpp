#include "lab/alias_table.h"

#include <algorithm>
#include <numeric>

namespace lab {

void AliasBuilder::append(const std::vector<std::uint32_t>& items, const std::vector<double>& weights,
                          std::vector<AliasSlot>& table) {
    const std::size_t count = items.size(), first = table.size();
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    scaled_.assign(count, 1.0);
    if (total > 0)
        for (std::size_t i = 0; i < count; ++i) scaled_[i] = weights[i] / total * static_cast<double>(count);
    small_.clear();
    large_.clear();
    for (std::size_t i = 0; i < count; ++i) {
        (scaled_[i] < 1 ? small_ : large_).push_back(static_cast<std::uint32_t>(i));
        table.push_back({items[i], items[i], 0});
    }
    // Each slot that is not full is filled up by an item that has more than its own.
    while (!small_.empty() && !large_.empty()) {
        const std::uint32_t poor = small_.back(), rich = large_.back();
        small_.pop_back();
        table[first + poor].other = items[rich];
        table[first + poor].keep = static_cast<std::uint32_t>(std::min(scaled_[poor] * 0x1p32, 0x1p32 - 1));
        scaled_[rich] -= 1 - scaled_[poor];
        if (scaled_[rich] >= 1) continue;
        large_.pop_back();
        small_.push_back(rich);
    }
    // What rounding leaves over is full; but nothing may come from an item without weight.
    const auto heaviest = static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
    for (const std::uint32_t i : small_)
        if (total > 0 && !(weights[i] > 0)) table[first + i].other = items[heaviest];
}

}  // namespace lab
