// Stage render_gbuffer: what the camera sees, one ray through each pixel's centre.
#pragma once

#include "lab/buffer.h"
#include "lab/camera.h"

namespace lab {

struct GBufferData {
    Buffer<vec3> position, normal, geometric_normal, albedo, emission;
    Buffer<float> depth;
    float pixel_angle;
};

// The image's packets of rays: blocks of 4 x 4 pixels, neighbours in both directions, stay together in the tree.
class PixelBlocks {
  public:
    static constexpr int side = 4;

    PixelBlocks(const Camera& camera, int width, int height)
        : camera_(camera, width, height), width_(width), height_(height) {}

    int columns() const { return (width_ + side - 1) / side; }
    int rows() const { return (height_ + side - 1) / side; }
    int width() const { return width_; }
    int height() const { return height_; }
    const CameraRays& camera() const { return camera_; }

    // The rays of block (column, row), all sixteen; returns how many of its pixels the image has. Ray i goes through
    // pixel (i % 4, i / 4) of the block.
    int rays(int column, int row, RayPacket& packet) const;

    // What one thread takes at a time, in blocks: rays of a tile meet the same parts of the tree.
    struct Tile {
        int left, top, right, bottom;
    };
    int tiles() const { return tiles_across() * ((rows() + tile_height - 1) / tile_height); }
    Tile tile(int i) const;

  private:
    static constexpr int tile_width = 32, tile_height = 8;

    int tiles_across() const { return (columns() + tile_width - 1) / tile_width; }

    CameraRays camera_;
    int width_, height_;
};

GBufferData render_gbuffer(const Scene& scene, const Camera& camera, int width, int height);

}  // namespace lab
