// Slots of alias tables in eight bytes, none of which straddles a line of the cache: drawing waits for memory.
#pragma once

#include <cstdint>
#include <span>

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

inline Buffer<PackedSlot> packed(std::span<const AliasSlot> slots) {
    Buffer<PackedSlot> out;
    out.resize(slots.size());
    const auto count = static_cast<std::int64_t>(slots.size());
#pragma omp parallel for schedule(static)
    for (std::int64_t i = 0; i < count; ++i) out[i] = pack(slots[i]);
    return out;
}

}  // namespace lab
