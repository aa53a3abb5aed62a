#include "lab/light_tile.h"

#include <algorithm>
#include <limits>

#include "lab/luminance.h"
#include "lab/random.h"
#include "lab/reservoir.h"
#include "lab/select.h"

namespace lab {
namespace {

const Box empty_box{vec3(std::numeric_limits<float>::max()), vec3(std::numeric_limits<float>::lowest())};

void extend(Box& box, const vec3& p) {
    box = {glm::min(box.low, p), glm::max(box.high, p)};
}

// Bits of x spread three apart, for a Morton code of 8 bits an axis.
std::uint32_t spread(std::uint32_t x) {
    x = (x | (x << 8)) & 0x0000f00fu;
    x = (x | (x << 4)) & 0x000c30c3u;
    return (x | (x << 2)) & 0x00249249u;
}

// Sorts a tile's pixels along a Morton curve through its box: runs of them stay compact in space even where
// the picture jumps in depth. Ties keep their order.
void sort_in_space(const GBufferView& g, const Box& box, std::vector<std::uint32_t>& pixel) {
    const vec3 extent = box.high - box.low;
    const float longest = std::max(extent.x, std::max(extent.y, extent.z));
    const float scale = longest > 0 ? 255.0f / longest : 0.0f;
    std::uint64_t keyed[tile_pixels];
    for (std::size_t i = 0; i < pixel.size(); ++i) {
        const glm::uvec3 at((g.position[pixel[i]] - box.low) * scale);
        const std::uint64_t code = spread(at.x) | spread(at.y) << 1 | spread(at.z) << 2;
        keyed[i] = code << 32 | pixel[i];
    }
    std::sort(keyed, keyed + pixel.size());
    for (std::size_t i = 0; i < pixel.size(); ++i) pixel[i] = static_cast<std::uint32_t>(keyed[i]);
}

}  // namespace

void GroupBounds::set(int group, const Box& points, const Box& normals) {
    for (int a = 0; a < 3; ++a) {
        low[a][group] = points.low[a];
        high[a][group] = points.high[a];
        normal_low[a][group] = normals.low[a];
        normal_high[a][group] = normals.high[a];
    }
}

LightTile::LightTile(const LightSettings& light, const PickSettings& picks) : light_(light), picks_(picks) {
    const std::size_t slots = static_cast<std::size_t>(picks.samples) * tile_pixels;
    state_.resize(slots);
    pick_weight_.resize(slots);
    pick_.resize(slots);
}

void LightTile::load(const GBufferView& gbuffer, std::vector<std::uint32_t>& pixel) {
    count_ = static_cast<int>(pixel.size());
    groups_ = (count_ + group_lanes - 1) / group_lanes;
    box_ = empty_box;
    for (const std::uint32_t p : pixel) extend(box_, gbuffer.position[p]);
    sort_in_space(gbuffer, box_, pixel);
    for (int group = 0; group < groups_; ++group) {
        Box points = empty_box, normals = empty_box;
        for (int i = group * group_lanes; i < (group + 1) * group_lanes; ++i) {
            const std::uint32_t p = pixel[std::min(i, count_ - 1)];  // lanes past the last repeat it, unread
            const vec3 position = gbuffer.position[p], normal = gbuffer.normal[p];
            extend(points, position);
            extend(normals, normal);
            px_[i] = position.x;
            py_[i] = position.y;
            pz_[i] = position.z;
            nx_[i] = normal.x;
            ny_[i] = normal.y;
            nz_[i] = normal.z;
            pixel_[i] = p;
            red_[i] = green_[i] = blue_[i] = sum_[i] = earlier_sum_[i] = 0.0f;
            used_[i] = overdraw_[i] = 0;
            for (int s = 0; s < picks_.samples; ++s) {
                const int slot = s * tile_pixels + i;
                pick_[slot] = -1;
                pick_weight_[slot] = 0.0f;
                state_[slot] = std::numeric_limits<float>::infinity();
            }
        }
        bounds_.set(group, points, normals);
        covers_group_[group] = lights_seen_[group] = 0;
        if (picks_.picker == Picker::reservoir) draw_uniforms(group * group_lanes, 0);
    }
    for (int group = groups_; group < tile_groups; ++group)  // never seen: a box at infinity
        bounds_.set(group, {vec3(1e30f), vec3(1e30f)}, {vec3(0.0f), vec3(0.0f)});
}

void LightTile::restart_picks() {
    const int lanes = groups_ * group_lanes;
    for (int i = 0; i < lanes; ++i) {
        earlier_sum_[i] = sum_[i];
        sum_[i] = 0.0f;  // the next light that contributes replaces any pick
    }
    if (picks_.picker == Picker::race) std::fill(state_.begin(), state_.end(), std::numeric_limits<float>::infinity());
}

bool LightTile::count_overdraw(const vec3& position, float half_edge, bool everywhere) {
    const vec3 gap = glm::max(box_.low - position, position - box_.high);
    if (!everywhere && (gap.x > half_edge || gap.y > half_edge || gap.z > half_edge)) return false;
    float nearest[tile_groups] = {}, farthest[tile_groups] = {};  // by the largest axis: cubes
    for (int a = 0; a < 3; ++a) {
        const float at = position[a];
#pragma omp simd
        for (int group = 0; group < tile_groups; ++group) {
            const float below = bounds_.low[a][group] - at, above = at - bounds_.high[a][group];
            nearest[group] = larger(nearest[group], larger(below, above));
            farthest[group] = larger(farthest[group], larger(-below, -above));
        }
    }
    const float x = position.x, y = position.y, z = position.z;
    bool any = false;
    for (int group = 0; group < groups_; ++group) {
        if (everywhere || farthest[group] <= half_edge) {
            ++covers_group_[group];
            any = true;
        } else if (nearest[group] <= half_edge) {
            const int first = group * group_lanes;
#pragma omp simd
            for (int i = first; i < first + group_lanes; ++i)
                overdraw_[i] += std::abs(px_[i] - x) <= half_edge && std::abs(py_[i] - y) <= half_edge &&
                                std::abs(pz_[i] - z) <= half_edge;
            any = true;
        }
    }
    return any;
}

void LightTile::find_groups(const LightTerm& light, float outer_radius, std::int32_t (&sees)[tile_groups]) const {
    // Bounds over every vector from a point of a group to the light: its squared length, its largest reach,
    // how far the light rises above the receivers' horizon, and how far they stand before the light.
    float least2[tile_groups] = {}, most2[tile_groups] = {}, reach[tile_groups] = {};
    float above[tile_groups] = {}, ahead[tile_groups] = {};
    for (int a = 0; a < 3; ++a) {
        const float at = light.position[a], m = -light.lobe.mean[a];
#pragma omp simd
        for (int group = 0; group < tile_groups; ++group) {
            const float low = at - bounds_.high[a][group], high = at - bounds_.low[a][group];
            const float least = larger(0.0f, larger(low, -high)), most = larger(magnitude(low), magnitude(high));
            const float n0 = bounds_.normal_low[a][group], n1 = bounds_.normal_high[a][group];
            least2[group] += least * least;
            most2[group] += most * most;
            reach[group] += most;
            above[group] += larger(larger(n0 * low, n0 * high), larger(n1 * low, n1 * high));
            ahead[group] += larger(m * low, m * high);
        }
    }
    const float slack = 1e-5f;  // for rounding: a group is left out only where surely nothing arrives
    const float outer2 = outer_radius * outer_radius * (1 + slack);
    const float inner2 = light.blend.up_slope > 0 ? light.inner_radius * light.inner_radius * (1 - slack) : -1.0f;
    const std::int32_t any_horizon = light_.receiver == Receiver::soft, any_side = !light.lobe.one_sided();
#pragma omp simd
    for (int group = 0; group < tile_groups; ++group) {
        const std::int32_t in_range = (least2[group] <= outer2) & (most2[group] >= inner2);
        const std::int32_t over_horizon = (above[group] >= -slack * reach[group]) | any_horizon;
        const std::int32_t lit_side = (ahead[group] >= -slack * reach[group]) | any_side;
        sees[group] = in_range & over_horizon & lit_side;
    }
}

template <bool soft, bool clamped>
float LightTile::add_to_group(const LightTerm& term, int first, float (&target)[group_lanes]) {
    const LightTerm light = term;  // a copy: stores to the lanes cannot change it, so it stays in registers
    const float red = light.intensity.x, green = light.intensity.y, blue = light.intensity.z;
    const float bright = luminance(light.intensity), clamp2 = light_.clamp2;
    const bool importance = picks_.importance;
    float weight[group_lanes];
    // Three short loops: GCC 12 vectorises each of them, but not their sum.
#pragma omp simd
    for (int lane = 0; lane < group_lanes; ++lane) {
        const int i = first + lane;
        weight[lane] = receive<soft, clamped>(light, clamp2, px_[i], py_[i], pz_[i], nx_[i], ny_[i], nz_[i]).weight;
    }
    float most = 0.0f;
#pragma omp simd reduction(max : most)
    for (int lane = 0; lane < group_lanes; ++lane) {
        const int i = first + lane;
        red_[i] += weight[lane] * red;
        green_[i] += weight[lane] * green;
        blue_[i] += weight[lane] * blue;
        target[lane] = weight[lane] * bright;
        most = larger(most, target[lane]);
    }
    if (most <= 0.0f) return most;
#pragma omp simd
    for (int lane = 0; lane < group_lanes; ++lane) {
        const bool lit = target[lane] > 0.0f;
        used_[first + lane] += lit ? 1u : 0u;
        target[lane] = importance || !lit ? target[lane] : 1.0f;
    }
    return most;
}

void LightTile::add(const LightTerm& light, std::uint32_t merged_index, float outer_radius) {
    std::int32_t sees[tile_groups];
    find_groups(light, outer_radius, sees);
    with_kinds(light_, [&]<bool soft, bool clamped>() {
        for (int group = 0; group < groups_; ++group) {
            if (!sees[group]) continue;
            float target[group_lanes];
            const int first = group * group_lanes;
            const float most = add_to_group<soft, clamped>(light, first, target);
            if (most <= 0.0f || picks_.samples == 0) continue;
            if (picks_.picker == Picker::race)
                pick_by_race(merged_index, first, target);
            else
                pick_by_reservoir(merged_index, first, target);
        }
    });
}

void LightTile::draw_uniforms(int first, std::uint32_t turn) {
    for (int s = 0; s < picks_.samples; ++s)
        for (int i = first; i < first + group_lanes; ++i) {
            const std::uint32_t which = turn * max_shadow_samples + static_cast<std::uint32_t>(s);
            state_[s * tile_pixels + i] = to_unit(random4(pixel_[i], which, Stream::pick, picks_.key).x);
        }
}

void LightTile::pick_by_reservoir(std::uint32_t merged_index, int first, const float (&target)[group_lanes]) {
    const auto light = static_cast<std::int32_t>(merged_index);
    // Each decision uses up some of a uniform's 24 bits. What is left is independent of the past, so it can be
    // replaced at any time: every few lights it is, long before the bits run out.
    constexpr std::uint32_t lights_per_uniform = 16;
    std::uint32_t& seen = lights_seen_[first / group_lanes];
    if (++seen % lights_per_uniform == 0) draw_uniforms(first, seen / lights_per_uniform);
    float take[group_lanes], taken_scale[group_lanes], kept_scale[group_lanes];
    float* sum = sum_ + first;
#pragma omp simd
    for (int lane = 0; lane < group_lanes; ++lane) {
        const ReservoirStep step = reservoir_step(sum[lane], target[lane]);
        take[lane] = step.take;
        taken_scale[lane] = step.taken_scale;
        kept_scale[lane] = step.kept_scale;
        sum[lane] += target[lane];
    }
    for (int s = 0; s < picks_.samples; ++s) {
        float* uniform = state_.data() + s * tile_pixels + first;
        float* weight = pick_weight_.data() + s * tile_pixels + first;
        std::int32_t* pick = pick_.data() + s * tile_pixels + first;
#pragma omp simd
        for (int lane = 0; lane < group_lanes; ++lane) {
            weight[lane] = uniform[lane] < take[lane] ? target[lane] : weight[lane];
            reservoir_decide({take[lane], taken_scale[lane], kept_scale[lane]}, light, uniform[lane], pick[lane]);
        }
    }
}

void LightTile::pick_by_race(std::uint32_t merged_index, int first, const float (&target)[group_lanes]) {
    const auto light = static_cast<std::int32_t>(merged_index);
    float* sum = sum_ + first;
    for (int lane = 0; lane < group_lanes; ++lane) sum[lane] += target[lane];
    for (int s = 0; s < picks_.samples; ++s) {
        float* best = state_.data() + s * tile_pixels + first;
        float* weight = pick_weight_.data() + s * tile_pixels + first;
        std::int32_t* pick = pick_.data() + s * tile_pixels + first;
        const std::uint32_t key = picks_.key + static_cast<std::uint32_t>(s) * 0x9e3779b9u;
#pragma omp simd
        for (int lane = 0; lane < group_lanes; ++lane) {
            const float f = target[lane];
            const float mine = race_key(random4(pixel_[first + lane], merged_index, Stream::race, key).x, f);
            const bool wins = f > 0.0f && mine < best[lane];
            best[lane] = wins ? mine : best[lane];
            weight[lane] = wins ? f : weight[lane];
            pick[lane] = wins ? light : pick[lane];
        }
    }
}

void LightTile::take_counts(std::uint32_t* overdraw, std::uint32_t* used) {
    for (int i = 0; i < count_; ++i) {
        overdraw[i] = overdraw_[i] + covers_group_[i / group_lanes];
        used[i] = used_[i];
    }
    const int lanes = groups_ * group_lanes;
    std::fill_n(overdraw_, lanes, 0u);
    std::fill_n(used_, lanes, 0u);
    std::fill_n(covers_group_, groups_, 0u);
}

}  // namespace lab
