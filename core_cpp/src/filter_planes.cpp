#include "lab/filter_planes.h"

#include <algorithm>

#include "lab/filter_strip.h"

namespace lab {

void Planes::reflect_sides(int step, int radius) {
    struct Run {
        int to, from, count;
    };
    std::vector<Run> runs;
    const int reach = std::min(radius * step, border);
    const auto add = [&](int x) {
        const int from = reflected(x, step, width_);
        if (from < 0) return;
        if (!runs.empty() && runs.back().to + runs.back().count == x && runs.back().from + runs.back().count == from)
            ++runs.back().count;
        else
            runs.push_back({x, from, 1});
    };
    for (int x = -reach; x < 0; ++x) add(x);
    for (int x = width_; x < width_ + reach; ++x) add(x);

#pragma omp parallel for schedule(static) if (worth_threads())
    for (int y = 0; y < height_; ++y)
        for (int plane = 0; plane < count_; ++plane) {
            float* pixel = row(plane, y);
            for (const Run& run : runs)  // short: no library call
                for (int i = 0; i < run.count; ++i) pixel[run.to + i] = pixel[run.from + i];
        }
}

std::vector<Strip> strips(int width, int height, int step) {
    // The pairs of a line and the rows that it reads stay in a core's own cache; the two lines before a strip, whose
    // pairs its first lines need, cost little.
    constexpr int most_lines = 32;
    const int tiles = (width + widest_strip - 1) / widest_strip;
    const int tile = ((width + tiles - 1) / tiles + 63) / 64 * 64;
    std::vector<Strip> all;
    for (int residue = 0; residue < std::min(step, height); ++residue) {
        const int lines = (height - residue + step - 1) / step, parts = (lines + most_lines - 1) / most_lines;
        for (int part = 0; part < parts; ++part)
            for (int x = 0; x < width; x += tile)
                all.push_back({step, residue, lines * part / parts, lines * (part + 1) / parts, x,
                               std::min(width, x + tile), height});
    }
    return all;
}

}  // namespace lab
