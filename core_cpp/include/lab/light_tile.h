// A tile of pixels being lit: structure of arrays, one SIMD lane a pixel, picks kept beside the sums. The
// tile's pixels are sorted in space into groups of one vector each, and every light is evaluated by the
// groups that can see it.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/contribution.h"
#include "lab/light_rows.h"

namespace lab {

inline constexpr int group_lanes = 16, tile_groups = 16, tile_pixels = group_lanes * tile_groups;

// How shadow samples are picked while lights stream by.
struct PickSettings {
    int samples;
    bool importance;
    Picker picker;
    std::uint32_t key;  // of the frame
};

// Bounds of each group's points and normals, as planes over groups so that all groups are tested at once.
struct alignas(64) GroupBounds {
    float low[3][tile_groups], high[3][tile_groups], normal_low[3][tile_groups], normal_high[3][tile_groups];

    void set(int group, const Box& points, const Box& normals);
};

class alignas(64) LightTile {
  public:
    LightTile(const LightSettings& light, const PickSettings& picks);

    // Takes the pixels that see a surface. `pixel`: their rows in the G-buffer; they come back in the tile's
    // order.
    void load(const GBufferView& gbuffer, std::vector<std::uint32_t>& pixel);
    int count() const { return count_; }
    const Box& box() const { return box_; }

    // Counts a light in the overdraw of the pixels inside its cube; returns false where it covers none.
    bool count_overdraw(const vec3& position, float half_edge, bool everywhere);
    // Adds a light to the sums, counts and reservoirs of the groups that can see it. `outer_radius`: where
    // its blend ends.
    void add(const LightTerm& light, std::uint32_t merged_index, float outer_radius);
    // From here on picks are made among the coming lights alone, unless none of them contributes.
    void restart_picks();

    // Results of the level since the last call, by loaded pixel.
    void take_counts(std::uint32_t* overdraw, std::uint32_t* used);
    vec3 irradiance(int i) const { return {red_[i], green_[i], blue_[i]}; }
    float weight_sum(int i) const { return sum_[i] > 0 ? sum_[i] : earlier_sum_[i]; }
    std::int32_t pick(int sample, int i) const { return pick_[sample * tile_pixels + i]; }
    float pick_weight(int sample, int i) const { return pick_weight_[sample * tile_pixels + i]; }

  private:
    // The lanes come first: whole vectors each, so all of them start on a vector's boundary. (alignas on each
    // member would give their elements a type that GCC 12 does not vectorise.)
    float px_[tile_pixels], py_[tile_pixels], pz_[tile_pixels], nx_[tile_pixels], ny_[tile_pixels], nz_[tile_pixels];
    float red_[tile_pixels], green_[tile_pixels], blue_[tile_pixels], sum_[tile_pixels], earlier_sum_[tile_pixels];
    std::uint32_t used_[tile_pixels], overdraw_[tile_pixels], pixel_[tile_pixels];
    GroupBounds bounds_;
    std::uint32_t covers_group_[tile_groups], lights_seen_[tile_groups];
    LightSettings light_;
    PickSettings picks_;
    int count_ = 0, groups_ = 0;
    Box box_;
    std::vector<float> state_,
        pick_weight_;  // per sample: the reservoir's uniform, or the race's smallest key
    std::vector<std::int32_t> pick_;

    // Which groups can see any of the light.
    void find_groups(const LightTerm& light, float outer_radius, std::int32_t (&sees)[tile_groups]) const;
    template <bool soft, bool clamped>
    float add_to_group(const LightTerm& term, int first, float (&target)[group_lanes]);
    void draw_uniforms(int first, std::uint32_t turn);
    void pick_by_reservoir(std::uint32_t merged_index, int first, const float (&target)[group_lanes]);
    void pick_by_race(std::uint32_t merged_index, int first, const float (&target)[group_lanes]);
};

}  // namespace lab
