// How compositing is shared out: strips of lines, and what a thread keeps of the lines around the one it works on.
#pragma once

#include "lab/composite.h"
#include "lab/filter_planes.h"

namespace lab {

// A picture to be composited.
struct Compositing {
    const GBufferView& g;
    const CompositeInput& in;
    const Params& params;
    ImageData& out;

    int tiles() const { return params.interleave; }  // a side
};

// Interleaving: the line or column that a window reads at `i` (at most `tiles` outside): at the border it folds back by
// whole tiles, which keeps each tile's share. -1: none.
inline int folded(int i, int tiles, int length) {
    if (i < 0) i += tiles;
    if (i >= length) i -= tiles;
    return i < length ? i : -1;
}

// The filtered shadow ratio of pixel (x, y), channel c. Where no sample says anything the pixels around it do: a hard 1
// would leak light. Where they know nothing either, no light is shown.
float ratio_at(const GBufferView& g, const CompositeInput& in, int x, int y, int c);

// One thread's scratch memory. `lines` holds the tiles + 1 lines of a window, by their place in the picture modulo
// that.
class CompositeLines {
  public:
    // The planes of a line: vectors have three. Normals of background are NaN: nothing is aligned with them.
    static constexpr int normal = 0, position = 3, irradiance = 6, ratio = 9;
    int shadowed() const { return ratio + channels; }  // luminance, or RGB of irradiance times ratio

    const int channels, count;
    Planes lines;
    Planes light;  // one line, as irradiance and ratio: recombined
    std::size_t image_stride;
    Buffer<float> image;  // one line of the five pictures, pixel after pixel

    CompositeLines(int width, int channels, int tiles)
        : channels(channels),
          count(tiles > 1 ? tiles + 1 : 1),
          lines(width, count, ratio + 2 * channels),
          light(width, 1, 3 + channels),
          image_stride(3 * static_cast<std::size_t>(width + Planes::slack)),
          image(5 * image_stride) {}

    float* row(int plane, int y) { return lines.row(plane, y % count); }
};

}  // namespace lab
