// Luminance of linear RGB (Rec. 709 primaries).
#pragma once

#include <glm/glm.hpp>

namespace lab {

inline float luminance(const glm::vec3& c) {
    return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

}  // namespace lab
