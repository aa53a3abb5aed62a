// Images in structure-of-arrays form, with side borders: all taps of a row are shifted, contiguous reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lab/buffer.h"

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

// `count` images of width x height floats, unset at first. Pixel x of a row may be read and written from -border to
// width + border + slack; rows start at cache lines. A line of the picture holds its `count` rows one after the other,
// and both strides are odd numbers of cache lines: rows that are read together never fall on the same cache set.
class Planes {
  public:
    static constexpr int border = 32;  // two taps of 16 pixels, the widest pass
    static constexpr int slack = 16;   // for whole vectors

    Planes(int width, int height, int count)
        : width_(width),
          height_(height),
          count_(count),
          stride_(odd_lines(width + 2 * border + slack)),
          line_stride_(odd_lines(stride_ * count)),
          values_(line_stride_ * height + line_floats) {
        const auto address = reinterpret_cast<std::uintptr_t>(values_.data());
        first_ = (line_floats - address / sizeof(float) % line_floats) % line_floats + border;
    }

    Planes(Planes&&) = default;
    Planes& operator=(Planes&&) = default;

    int width() const { return width_; }
    int height() const { return height_; }
    int count() const { return count_; }

    // Floats from a plane's row to the next plane's.
    std::size_t stride() const { return stride_; }

    // Threads cost more than they bring to a tiny picture.
    bool worth_threads() const { return width_ * height_ >= 4096; }

    float* row(int plane, int y) { return values_.data() + start(plane, y); }
    const float* row(int plane, int y) const { return values_.data() + start(plane, y); }

    // Fills the side borders for taps up to `radius` steps away.
    void reflect_sides(int step, int radius);

  private:
    static constexpr std::size_t line_floats = 16;  // of a cache line

    static std::size_t odd_lines(std::size_t floats) {
        return ((floats + line_floats - 1) / line_floats | 1) * line_floats;
    }
    std::size_t start(int plane, int y) const { return first_ + y * line_stride_ + plane * stride_; }

    int width_, height_, count_;
    std::size_t stride_, line_stride_, first_ = 0;
    Buffer<float> values_;
};

}  // namespace lab
