// Sorting a few thousand 32-bit words by their upper bits, in one counting pass for each digit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace lab {

// Stable, by the bits from `first` on, in two digits. Returns where the sorted words are: in `words` or in `spare`.
template <int first>
std::uint32_t* radix_sort(std::uint32_t* words, std::uint32_t* spare, std::size_t count) {
    constexpr int digit_bits = (32 - first + 1) / 2;
    constexpr std::uint32_t digits = 1u << digit_bits;
    std::array<std::array<std::uint32_t, digits>, 2> place{};
    for (std::size_t i = 0; i < count; ++i) {
        ++place[0][words[i] >> first & (digits - 1)];
        ++place[1][words[i] >> (first + digit_bits)];
    }
    int shift = first;
    for (auto& next : place) {
        std::uint32_t sum = 0;
        for (std::uint32_t& p : next) sum += std::exchange(p, sum);
        for (std::size_t i = 0; i < count; ++i) spare[next[words[i] >> shift & (digits - 1)]++] = words[i];
        std::swap(words, spare);
        shift += digit_bits;
    }
    return words;
}

}  // namespace lab
