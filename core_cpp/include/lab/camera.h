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
    Ray through(double x, double y) const {
        const double sx = (x - 0.5 * width_) * step_, sy = (0.5 * height_ - y) * step_;
        return {eye_, vec3(glm::normalize(forward_ + sx * right_ + sy * up_)), std::numeric_limits<float>::infinity()};
    }

    // Distance along the camera's axis of the point at `t` on a ray.
    float depth(const Ray& ray, float t) const {
        return t * static_cast<float>(glm::dot(glm::dvec3(ray.direction), forward_));
    }
    float pixel_angle() const { return static_cast<float>(step_); }

  private:
    vec3 eye_;
    int width_, height_;
    glm::dvec3 forward_, right_, up_;
    double step_;
};

}  // namespace lab
