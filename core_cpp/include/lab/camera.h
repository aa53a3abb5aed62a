// The pinhole camera and its rays.
#pragma once

#include <cmath>
#include <limits>

#include "lab/scene.h"

namespace lab {

struct Camera {
    vec3 eye, target, up;
    float fov_y;  // radians
};

// Rays through an image of the camera; in double: a camera far from the origin keeps its direction.
class CameraRays {
  public:
    CameraRays(const Camera& camera, int width, int height)
        : eye_(camera.eye),
          width_(width),
          height_(height),
          forward_(glm::normalize(glm::dvec3(camera.target) - glm::dvec3(camera.eye))),
          right_(glm::normalize(glm::cross(forward_, glm::dvec3(camera.up)))),
          up_(glm::cross(right_, forward_)),
          step_(2 * std::tan(0.5 * static_cast<double>(camera.fov_y)) / height) {}

    // Through the point (x, y) of the image, in pixels from its top left corner; a pixel's centre is at + 0.5.
    Ray through(double x, double y) const { return {eye_, direction(x, y), std::numeric_limits<float>::infinity()}; }
    LAB_INLINE vec3 direction(double x, double y) const {
        const double sx = (x - 0.5 * width_) * step_, sy = (0.5 * height_ - y) * step_;
        const double dx = forward_.x + sx * right_.x + sy * up_.x, dy = forward_.y + sx * right_.y + sy * up_.y;
        const double dz = forward_.z + sx * right_.z + sy * up_.z;
        const double scale = 1.0 / std::sqrt(dx * dx + dy * dy + dz * dz);
        return {static_cast<float>(dx * scale), static_cast<float>(dy * scale), static_cast<float>(dz * scale)};
    }
    vec3 eye() const { return eye_; }

    // Distance along the camera's axis of the point at `t` on a ray.
    LAB_INLINE float depth(const vec3& direction, float t) const {
        const double along = direction.x * forward_.x + direction.y * forward_.y + direction.z * forward_.z;
        return t * static_cast<float>(along);
    }
    float pixel_angle() const { return static_cast<float>(step_); }

  private:
    vec3 eye_;
    int width_, height_;
    glm::dvec3 forward_, right_, up_;
    double step_;
};

}  // namespace lab
