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

// Makes tables; keeps its buffers from one call to the next.
class AliasTables {
  public:
    static constexpr std::size_t vector = 8;

    // Of several tables, one after the other: table t has the slots from offset[t] - offset[0] up to the next one's.
    // Its items are drawn in proportion to `weight` (>= 0); those of weight 0 never, unless all are 0: then evenly.
    // Weights below 2^-36 of a table's largest count as 0. `weight` has room for one vector more.
    void fill(std::span<AliasSlot> slots, std::span<const std::int64_t> offset, std::span<const std::uint32_t> item,
              std::span<const double> weight);

  private:
    struct Items {
        std::vector<std::uint32_t> index;  // in their table
        std::vector<std::uint64_t> share;
    };
    std::vector<std::uint64_t> share_;  // of each item, in 2^-32 slots
    Items poor_, rich_;                 // of each table, and room for one more
};

}  // namespace lab
