#include "lab/grid.h"

#include "lab/select.h"

namespace lab {

Grid make_grid(std::span<const glm::vec3> positions, float bounds_scale) {
    const auto count = static_cast<std::int64_t>(positions.size());
    float low_x = positions[0].x, low_y = positions[0].y, low_z = positions[0].z;
    float high_x = low_x, high_y = low_y, high_z = low_z;
#pragma omp parallel for simd reduction(min : low_x, low_y, low_z) reduction(max : high_x, high_y, high_z)
    for (std::int64_t i = 0; i < count; ++i) {
        const glm::vec3& p = positions[i];
        low_x = smaller(low_x, p.x);
        low_y = smaller(low_y, p.y);
        low_z = smaller(low_z, p.z);
        high_x = larger(high_x, p.x);
        high_y = larger(high_y, p.y);
        high_z = larger(high_z, p.z);
    }
    const glm::vec3 low(low_x, low_y, low_z), high(high_x, high_y, high_z);
    const glm::vec3 extent = high - low, largest = glm::max(glm::abs(low), glm::abs(high));
    const float longest = std::max(extent.x, std::max(extent.y, extent.z));
    const float magnitude = std::max(largest.x, std::max(largest.y, largest.z));
    Grid grid;
    grid.top_size = std::max(longest * bounds_scale, std::max(magnitude * 1e-6f, 1e-20f));
    grid.origin = 0.5f * (low + high) - 0.5f * grid.top_size;
    return grid;
}

}  // namespace lab
