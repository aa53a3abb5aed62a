// Shadow samples of a group of pixels while they are being picked.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "lab/light_group.h"

namespace lab {

// How shadow samples are picked while lights stream by.
struct PickSettings {
    int samples;
    bool importance;
    Picker picker;
    std::uint32_t key;  // of the frame
};

// A run of lights as a group of pixels sees them.
struct LightBatch {
    static constexpr std::size_t most = 128;  // so that it stays in the first cache

    std::size_t size;
    float after[group_lanes];          // the running sum of the targets, with this run's
    float target[most * group_lanes];  // weight of each light at each pixel
    std::int32_t light[most];          // merged index
};

struct GroupPicks {
    std::vector<std::int32_t> light;  // (samples, lanes); -1: none
    std::vector<float> weight, key;   // key: the race's smallest
    float sum[group_lanes], earlier_sum[group_lanes];

    explicit GroupPicks(int samples) : light(samples * group_lanes), weight(light.size()), key(light.size()) {}

    void clear(Picker picker) {
        const auto slots = static_cast<int>(light.size());
        std::int32_t* const none = light.data();
        float* const zero = weight.data();
#pragma omp simd
        for (int i = 0; i < slots; ++i) {
            none[i] = -1;
            zero[i] = 0.0f;
        }
        if (picker == Picker::race) std::fill(key.begin(), key.end(), std::numeric_limits<float>::infinity());
        std::fill_n(sum, group_lanes, 0.0f);
        std::fill_n(earlier_sum, group_lanes, 0.0f);
    }

    // From here on picks are made among the coming lights alone, unless none of them contributes.
    void restart() {
        std::copy_n(sum, group_lanes, earlier_sum);
        std::fill_n(sum, group_lanes, 0.0f);  // the next light that contributes replaces any pick
        std::fill(key.begin(), key.end(), std::numeric_limits<float>::infinity());
    }

    float weight_sum(int lane) const { return sum[lane] > 0 ? sum[lane] : earlier_sum[lane]; }
};

}  // namespace lab
