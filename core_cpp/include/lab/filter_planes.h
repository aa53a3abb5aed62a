// Images in structure-of-arrays form, with side borders: all taps of a row are shifted, contiguous reads.
#pragma once

#include <cstddef>
#include <vector>

namespace lab {

// The pixel that a tap at `x` (any integer) reads in a row of `length` pixels: x itself inside, reflected
// outside. A pass of step s sees s separate sub-images, the pixels of each residue modulo s, and reflects
// inside its own (without repeating the edge; again and again where a sub-image is short). -1: the residue
// has no pixel at all.
inline int reflected(int x, int step, int length) {
    const int residue = ((x % step) + step) % step;
    if (residue >= length) return -1;
    const int count = (length - residue + step - 1) / step;
    if (count == 1) return residue;
    const int period = 2 * (count - 1);
    const int index = (((x - residue) / step) % period + period) % period;
    return residue + step * (index < count ? index : period - index);
}

// `count` images of width x height floats. Pixel x of a row may be read from -border to width + border.
class Planes {
  public:
    static constexpr int border = 32;  // two taps of 16 pixels, the widest pass

    Planes(int width, int height, int count)
        : width_(width),
          height_(height),
          count_(count),
          values_(static_cast<std::size_t>(width + 2 * border) * height * count) {}

    int width() const { return width_; }
    int height() const { return height_; }
    int count() const { return count_; }

    // Threads cost more than they bring to a tiny picture.
    bool worth_threads() const { return width_ * height_ >= 4096; }

    float* row(int plane, int y) { return values_.data() + start(plane, y); }
    const float* row(int plane, int y) const { return values_.data() + start(plane, y); }

    // Fills the side borders for taps up to `radius` steps away.
    void reflect_sides(int step, int radius);

  private:
    std::size_t start(int plane, int y) const {
        const auto row = static_cast<std::size_t>(plane) * height_ + y;
        return row * (width_ + 2 * border) + border;
    }

    int width_, height_, count_;
    std::vector<float> values_;
};

}  // namespace lab
