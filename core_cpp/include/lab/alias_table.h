// Drawing from a list in proportion to weights with one look into memory (Walker 1977). A table is filled by one sweep
// along its items, which a graphics card can enter anywhere (after Huebschle-Schneider and Sanders 2019), in whole
// numbers, whose sums don't depend on order: shaders/lib/alias_table.slang makes the same tables.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace lab {

// One of n equal slots: the item `own` in `keep` of 2^32 cases, else the item `other`.
struct AliasSlot {
    std::uint32_t own, other, keep;
};

// What 32 uniform bits choose: their leading part is the slot, what is left of them decides inside it.
struct AliasChoice {
    std::uint32_t slot, rest;
};
inline AliasChoice alias_choice(std::uint64_t count, std::uint32_t bits) {
    const std::uint64_t scaled = bits * count;
    return {static_cast<std::uint32_t>(scaled >> 32), static_cast<std::uint32_t>(scaled)};
}
inline std::uint32_t alias_item(const AliasSlot& slot, std::uint32_t rest) {
    return rest < slot.keep ? slot.own : slot.other;
}
inline std::uint32_t alias_draw(const AliasSlot* slots, std::uint64_t count, std::uint32_t bits) {
    const AliasChoice choice = alias_choice(count, bits);
    return alias_item(slots[choice.slot], choice.rest);
}

// Makes tables; keeps its buffers from one to the next.
class AliasTables {
  public:
    // Of slots (at least one) whose own items are set, for the `weight` (>= 0) of each. Items of weight 0 are never
    // drawn, unless all are 0: then evenly. Weights below 2^-36 of the largest count as 0.
    void fill(std::span<AliasSlot> table, std::span<const double> weight);

  private:
    std::vector<std::uint64_t> share_;  // of each item, in 2^-32 slots
    std::vector<std::uint32_t> poor_, rich_;

    void set_shares(std::span<const double> weight);
};

}  // namespace lab
