// A list of lights dealt to the interleaving tiles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lab {

inline constexpr std::uint8_t every_tile = 255;  // of a light that is not dealt

class DealtLists {
  public:
    // `tile_of`: of each light that `lights` may name. Each tile's list keeps the order. One tile alone sees `lights`.
    void deal(std::span<const std::uint32_t> lights, const std::uint8_t* tile_of, int tiles);
    std::span<const std::uint32_t> of(int tile) const {
        return all_.subspan(begin_[tile], begin_[tile + 1] - begin_[tile]);
    }

  private:
    std::vector<std::uint32_t> begin_, next_, dealt_;
    std::span<const std::uint32_t> all_;
};

inline void DealtLists::deal(std::span<const std::uint32_t> lights, const std::uint8_t* tile_of, int tiles) {
    begin_.assign(tiles + 1, 0);
    if (tiles == 1) {
        begin_[1] = static_cast<std::uint32_t>(lights.size());
        all_ = lights;
        return;
    }
    next_.assign(every_tile + 1, 0);
    for (const std::uint32_t light : lights) ++next_[tile_of[light]];
    const std::uint32_t shared = next_[every_tile];
    for (int t = 0; t < tiles; ++t) {
        begin_[t + 1] = begin_[t] + next_[t] + shared;
        next_[t] = begin_[t];
    }
    dealt_.resize(begin_[tiles]);
    for (const std::uint32_t light : lights) {
        const std::uint8_t tile = tile_of[light];
        if (tile != every_tile)
            dealt_[next_[tile]++] = light;
        else
            for (int t = 0; t < tiles; ++t) dealt_[next_[t]++] = light;
    }
    all_ = dealt_;
}

}  // namespace lab
