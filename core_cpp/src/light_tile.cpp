#include "lab/light_tile.h"

#include <algorithm>
#include <limits>

#include "lab/luminance.h"
#include "lab/random.h"
#include "lab/reservoir.h"

namespace lab {

LightTile::LightTile(const LightSettings& light, const PickSettings& picks) : light_(light), picks_(picks) {
    const std::size_t slots = static_cast<std::size_t>(picks.samples) * tile_pixels;
    state_.resize(slots);
    pick_weight_.resize(slots);
    pick_.resize(slots);
}

void LightTile::load(const GBufferView& gbuffer, const std::vector<std::uint32_t>& pixel) {
    count_ = static_cast<int>(pixel.size());
    if (count_ == 0) return;
    padded_ = std::min(tile_pixels, (count_ + 15) / 16 * 16);  // lanes past the last pixel repeat it, unread
    box_ = normals_ = {vec3(std::numeric_limits<float>::max()), vec3(std::numeric_limits<float>::lowest())};
    for (int i = 0; i < padded_; ++i) {
        const std::uint32_t p = pixel[std::min(i, count_ - 1)];
        const vec3 position = gbuffer.position[p], normal = gbuffer.normal[p];
        px_[i] = position.x;
        py_[i] = position.y;
        pz_[i] = position.z;
        nx_[i] = normal.x;
        ny_[i] = normal.y;
        nz_[i] = normal.z;
        pixel_[i] = p;
        box_ = {glm::min(box_.low, position), glm::max(box_.high, position)};
        normals_ = {glm::min(normals_.low, normal), glm::max(normals_.high, normal)};
        red_[i] = green_[i] = blue_[i] = sum_[i] = earlier_sum_[i] = 0.0f;
        used_[i] = overdraw_[i] = 0;
    }
    covers_all_ = 0;
    std::fill(pick_.begin(), pick_.end(), -1);
    std::fill(pick_weight_.begin(), pick_weight_.end(), 0.0f);
    for (int s = 0; s < picks_.samples; ++s)
        for (int i = 0; i < padded_; ++i)
            state_[s * tile_pixels + i] =
                picks_.picker == Picker::race
                    ? std::numeric_limits<float>::infinity()
                    : to_unit(random4(pixel_[i], static_cast<std::uint32_t>(s), Stream::pick, picks_.key).x);
}

void LightTile::restart_picks() {
    for (int i = 0; i < padded_; ++i) {
        earlier_sum_[i] = sum_[i];
        sum_[i] = 0.0f;  // the next light that contributes replaces any pick
    }
    if (picks_.picker == Picker::race)
        std::fill(state_.begin(), state_.end(), std::numeric_limits<float>::infinity());
}

bool LightTile::count_overdraw(const vec3& position, float half_edge, bool everywhere) {
    const vec3 farthest = glm::max(glm::abs(box_.low - position), glm::abs(box_.high - position));
    if (everywhere || (farthest.x <= half_edge && farthest.y <= half_edge && farthest.z <= half_edge)) {
        ++covers_all_;
        return true;
    }
    const vec3 gap = glm::max(box_.low - position, position - box_.high);
    if (gap.x > half_edge || gap.y > half_edge || gap.z > half_edge) return false;
    const float x = position.x, y = position.y, z = position.z;
#pragma omp simd
    for (int i = 0; i < padded_; ++i)
        overdraw_[i] += std::abs(px_[i] - x) <= half_edge && std::abs(py_[i] - y) <= half_edge &&
                        std::abs(pz_[i] - z) <= half_edge;
    return true;
}

bool LightTile::may_be_lit(const LightTerm& light, bool flat, float outer_radius) const {
    const vec3 low = light.position - box_.high, high = light.position - box_.low;  // every pixel-to-light vector
    const vec3 least = glm::max(vec3(0.0f), glm::max(low, -high)), most = glm::max(glm::abs(low), glm::abs(high));
    const float slack = 1e-5f;
    if (glm::dot(least, least) > outer_radius * outer_radius * (1 + slack)) return false;
    const bool fades_in = light.blend.up_slope > 0;
    if (fades_in && glm::dot(most, most) < light.inner_radius * light.inner_radius * (1 - slack)) return false;
    if (light_.receiver == Receiver::hard) {
        float above = 0;  // upper bound of normal . vector over both boxes
        for (int a = 0; a < 3; ++a)
            above += std::max(std::max(normals_.low[a] * low[a], normals_.low[a] * high[a]),
                              std::max(normals_.high[a] * low[a], normals_.high[a] * high[a]));
        if (above < -slack * (most.x + most.y + most.z)) return false;
    }
    if (flat) {  // one emitting normal: nothing goes behind it
        float ahead = 0;
        for (int a = 0; a < 3; ++a)
            ahead += std::max(-light.lobe.mean[a] * low[a], -light.lobe.mean[a] * high[a]);
        if (ahead < -slack * (most.x + most.y + most.z)) return false;
    }
    return true;
}

template <bool soft, bool clamped>
float LightTile::add_light(const LightTerm& light) {
    const float red = light.intensity.x, green = light.intensity.y, blue = light.intensity.z;
    const float bright = luminance(light.intensity), clamp2 = light_.clamp2;
    const bool importance = picks_.importance;
    float most = 0.0f;
#pragma omp simd reduction(max : most)
    for (int i = 0; i < padded_; ++i) {
        const float weight =
            receive<soft, clamped>(light, clamp2, px_[i], py_[i], pz_[i], nx_[i], ny_[i], nz_[i]).weight;
        red_[i] += weight * red;
        green_[i] += weight * green;
        blue_[i] += weight * blue;
        const float f = weight * bright;
        used_[i] += f > 0.0f;
        target_[i] = importance ? f : (f > 0.0f ? 1.0f : 0.0f);
        most = std::max(most, f);
    }
    return most;
}

void LightTile::add(const LightTerm& light, std::uint32_t merged_index) {
    const float most = with_kinds(light_, [&]<bool soft, bool clamped>() { return add_light<soft, clamped>(light); });
    if (most <= 0.0f || picks_.samples == 0) return;
    if (picks_.picker == Picker::race)
        pick_by_race(merged_index);
    else
        pick_by_reservoir(merged_index);
}

void LightTile::pick_by_reservoir(std::uint32_t merged_index) {
    const auto light = static_cast<std::int32_t>(merged_index);
#pragma omp simd
    for (int i = 0; i < padded_; ++i) {
        const ReservoirStep step = reservoir_step(sum_[i], target_[i]);
        take_[i] = step.take;
        taken_scale_[i] = step.taken_scale;
        kept_scale_[i] = step.kept_scale;
        sum_[i] += target_[i];
    }
    for (int s = 0; s < picks_.samples; ++s) {
        float* uniform = state_.data() + s * tile_pixels;
        float* weight = pick_weight_.data() + s * tile_pixels;
        std::int32_t* pick = pick_.data() + s * tile_pixels;
#pragma omp simd
        for (int i = 0; i < padded_; ++i) {
            weight[i] = uniform[i] < take_[i] ? target_[i] : weight[i];
            reservoir_decide({take_[i], taken_scale_[i], kept_scale_[i]}, light, uniform[i], pick[i]);
        }
    }
}

void LightTile::pick_by_race(std::uint32_t merged_index) {
    const auto light = static_cast<std::int32_t>(merged_index);
    for (int i = 0; i < padded_; ++i) sum_[i] += target_[i];
    for (int s = 0; s < picks_.samples; ++s) {
        float* best = state_.data() + s * tile_pixels;
        float* weight = pick_weight_.data() + s * tile_pixels;
        std::int32_t* pick = pick_.data() + s * tile_pixels;
        const std::uint32_t key = picks_.key + static_cast<std::uint32_t>(s) * 0x9e3779b9u;
#pragma omp simd
        for (int i = 0; i < padded_; ++i) {
            const float f = target_[i];
            const float mine = race_key(random4(pixel_[i], merged_index, Stream::race, key).x, f);
            const bool wins = f > 0.0f && mine < best[i];
            best[i] = wins ? mine : best[i];
            weight[i] = wins ? f : weight[i];
            pick[i] = wins ? light : pick[i];
        }
    }
}

void LightTile::take_counts(std::uint32_t* overdraw, std::uint32_t* used) {
    for (int i = 0; i < count_; ++i) {
        overdraw[i] = overdraw_[i] + covers_all_;
        used[i] = used_[i];
    }
    std::fill_n(overdraw_, padded_, 0u);
    std::fill_n(used_, padded_, 0u);
    covers_all_ = 0;
}

}  // namespace lab
