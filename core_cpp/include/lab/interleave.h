// Interleaved sampling: lights are dealt to n x n tiles of pixels (LY19 4.3; Keller & Heidrich 2001).
#pragma once

#include <cstdint>

#include "lab/random.h"

namespace lab {

// Pixel (x, y) belongs to tile (x mod n, y mod n).
inline int interleave_tile(int x, int y, int n) {
    return (y % n) * n + x % n;
}

// A level with fewer lights than tiles is not dealt: every tile sees it, at weight 1.
inline bool is_dealt(std::int64_t lights, int n, bool deal_all) {
    return n > 1 && (deal_all || lights >= static_cast<std::int64_t>(n) * n);
}

// Each run of n^2 lights (neighbours in grid order) is dealt one to each tile by a permutation of its own, so that
// tiles get even shares and no grid pattern shows.
class DealtRun {
  public:
    DealtRun(std::uint32_t run, std::uint32_t level, int n)
        : r_(pcg4d({run, level, 0x51ed270bu, 0xb5297a4du})), last_(static_cast<std::uint32_t>(n * n) - 1) {}
    int tile(std::uint32_t place) const { return static_cast<int>(((place ^ r_.x) * (r_.y | 1u) + r_.z) & last_); }

  private:
    Random4 r_;
    std::uint32_t last_;
};

// The tile that light `index` of `level` is dealt to.
inline int dealt_tile(std::uint32_t index, std::uint32_t level, int n) {
    const auto tiles = static_cast<std::uint32_t>(n * n);
    return DealtRun(index / tiles, level, n).tile(index % tiles);
}

}  // namespace lab
