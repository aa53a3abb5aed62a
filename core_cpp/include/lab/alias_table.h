// Drawing from a list in proportion to weights with one look into memory (Walker 1977, built as by Vose 1991).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace lab {

// One of n equal slots: the item `own` in `keep` of 2^32 cases, else the item `other`.
struct AliasSlot {
    std::uint32_t own, other, keep;
};

// The item that 32 uniform bits choose: their leading part is the slot, what is left of them decides inside it.
inline std::uint32_t alias_draw(const AliasSlot* slots, std::uint64_t count, std::uint32_t bits) {
    const std::uint64_t scaled = bits * count;
    const AliasSlot& slot = slots[scaled >> 32];
    return static_cast<std::uint32_t>(scaled) < slot.keep ? slot.own : slot.other;
}

// Appends the table of `items` (at least one) with their `weights` (>= 0). Items of weight 0 are never drawn, unless
// all are 0: then evenly. Keeps its buffers from list to list.
class AliasBuilder {
  public:
    void append(const std::vector<std::uint32_t>& items, const std::vector<double>& weights,
                std::vector<AliasSlot>& table);

  private:
    std::vector<double> scaled_;
    std::vector<std::uint32_t> small_, large_;
};

}  // namespace lab
