// Slots of alias tables in eight bytes, none of which straddles a line of the cache: drawing waits for memory.
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>

#include "lab/alias_table.h"
#include "lab/buffer.h"

namespace lab {

// From the lowest bit: `own` and `other` in 24 bits each, the leading 16 of `keep`. What these cannot tell is looked up
// in the slot itself, so that items are the very ones of alias_item().
using PackedSlot = std::uint64_t;
inline constexpr std::uint32_t beyond_packed = 0xffffffu;  // as `own`: one of the items is too large a number

inline PackedSlot pack(const AliasSlot& slot) {
    const bool fits = slot.own < beyond_packed && slot.other < beyond_packed;
    const PackedSlot own = fits ? slot.own : beyond_packed, other = fits ? slot.other : 0;
    return own | other << 24 | static_cast<PackedSlot>(slot.keep >> 16) << 48;
}

// The item, if packed_decides().
inline std::uint32_t packed_item(PackedSlot slot, std::uint32_t rest) {
    const auto own = static_cast<std::uint32_t>(slot) & 0xffffffu;
    const auto other = static_cast<std::uint32_t>(slot >> 24) & 0xffffffu;
    return rest >> 16 < static_cast<std::uint32_t>(slot >> 48) ? own : other;
}
inline bool packed_decides(PackedSlot slot, std::uint32_t rest) {
    const bool fits = (static_cast<std::uint32_t>(slot) & 0xffffffu) != beyond_packed;
    return fits & (rest >> 16 != static_cast<std::uint32_t>(slot >> 48));
}

// Where a table begins and how many slots it has, in the lower and upper half: both by one look.
using TableRow = std::uint64_t;

inline std::uint32_t table_first(TableRow row) {
    return static_cast<std::uint32_t>(row);
}
inline std::uint32_t table_size(TableRow row) {
    return static_cast<std::uint32_t>(row >> 32);
}

// All tables, and where they are.
class PackedTables {
  public:
    PackedTables() = default;
    PackedTables(std::span<const AliasSlot> slots, std::span<const std::int64_t> offset)
        : words_(slots.size() + (offset.empty() ? 0 : offset.size() - 1)), slots_(slots.size()) {
        if (slots.size() > 0xffffffffu)
            throw std::length_error("members: more than 2^32 of them, and shadow points cannot be drawn");
        const auto count = static_cast<std::int64_t>(slots_), all = static_cast<std::int64_t>(words_.size());
#pragma omp parallel for schedule(static)
        for (std::int64_t i = 0; i < all; ++i) {
            if (i < count) {
                words_[i] = pack(slots[i]);
            } else {
                const std::int64_t first = offset[i - count], size = offset[i - count + 1] - first;
                words_[i] = static_cast<TableRow>(first) | static_cast<TableRow>(size) << 32;
            }
        }
    }

    const PackedSlot* slots() const { return words_.data(); }
    const TableRow* rows() const { return words_.data() + slots_; }

  private:
    Buffer<std::uint64_t> words_;  // slots, then rows: together they lie in the same huge pages
    std::size_t slots_ = 0;
};

}  // namespace lab
