// A tile of pixels being lit: structure of arrays, one SIMD lane a pixel, picks kept beside the sums.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/contribution.h"
#include "lab/light_rows.h"

namespace lab {

inline constexpr int tile_pixels = 256;

// How shadow samples are picked while lights stream by.
struct PickSettings {
    int samples;
    bool importance;
    Picker picker;
    std::uint32_t key;  // of the frame
};

class LightTile {
  public:
    LightTile(const LightSettings& light, const PickSettings& picks);

    // Takes the pixels that see a surface. `pixel`: their rows in the G-buffer.
    void load(const GBufferView& gbuffer, const std::vector<std::uint32_t>& pixel);
    int count() const { return count_; }
    const Box& box() const { return box_; }

    // A light can be skipped where no pixel of the tile can see any of it.
    bool may_be_lit(const LightTerm& light, bool flat, float outer_radius) const;
    // Adds a light to every pixel's sums, counts and reservoirs.
    void add(const LightTerm& light, std::uint32_t merged_index);
    // From here on picks are made among the coming lights alone, unless none of them contributes.
    void restart_picks();
    // Counts a light in the overdraw of the pixels inside its cube; returns false where it covers none.
    bool count_overdraw(const vec3& position, float half_edge, bool everywhere);

    // Results of the level since the last call, by loaded pixel.
    void take_counts(std::uint32_t* overdraw, std::uint32_t* used);
    vec3 irradiance(int i) const { return {red_[i], green_[i], blue_[i]}; }
    float weight_sum(int i) const { return sum_[i] > 0 ? sum_[i] : earlier_sum_[i]; }
    std::int32_t pick(int sample, int i) const { return pick_[sample * tile_pixels + i]; }
    float pick_weight(int sample, int i) const { return pick_weight_[sample * tile_pixels + i]; }

  private:
    using Lane = float[tile_pixels];
    LightSettings light_;
    PickSettings picks_;
    int count_ = 0, padded_ = 0;
    Box box_, normals_;
    std::uint32_t covers_all_ = 0;
    alignas(64) Lane px_, py_, pz_, nx_, ny_, nz_;
    alignas(64) Lane red_, green_, blue_, target_, sum_, earlier_sum_;
    alignas(64) Lane take_, taken_scale_, kept_scale_;
    alignas(64) std::uint32_t used_[tile_pixels], overdraw_[tile_pixels], pixel_[tile_pixels];
    std::vector<float> state_, pick_weight_;  // per sample: the reservoir's uniform, or the race's smallest key
    std::vector<std::int32_t> pick_;

    template <bool soft, bool clamped>
    float add_light(const LightTerm& light);
    void pick_by_reservoir(std::uint32_t merged_index);
    void pick_by_race(std::uint32_t merged_index);
};

}  // namespace lab
