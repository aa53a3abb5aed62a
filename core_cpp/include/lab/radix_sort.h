// Sorting a few thousand records by the upper half of a 64-bit word, in one counting pass for each digit.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace lab {

// A key in the upper 32 bits, what it belongs to in the lower.
using Keyed = std::uint64_t;

inline Keyed keyed(std::uint32_t key, std::uint32_t value) {
    return static_cast<Keyed>(key) << 32 | value;
}
inline std::uint32_t key_of(Keyed k) {
    return static_cast<std::uint32_t>(k >> 32);
}
inline std::uint32_t value_of(Keyed k) {
    return static_cast<std::uint32_t>(k);
}

// Stable, by bits first .. first + count - 1 of the key, `digit_bits` a pass. `spare` is scratch.
template <int digit_bits>
void radix_sort(std::vector<Keyed>& records, std::vector<Keyed>& spare, int first, int count) {
    constexpr std::uint32_t digits = 1u << digit_bits;
    spare.resize(records.size());
    for (int shift = 32 + first; shift < 32 + first + count; shift += digit_bits) {
        std::array<std::uint32_t, digits> place{};
        for (const Keyed k : records) ++place[(k >> shift) & (digits - 1)];
        std::uint32_t sum = 0;
        for (std::uint32_t& p : place) {
            const std::uint32_t size = p;
            p = sum;
            sum += size;
        }
        for (const Keyed k : records) spare[place[(k >> shift) & (digits - 1)]++] = k;
        records.swap(spare);
    }
}

}  // namespace lab
