#include "lab/filter_planes.h"

#include <algorithm>

namespace lab {

void Planes::reflect_sides(int step, int radius) {
    struct Copy {
        int to, from;
    };
    std::vector<Copy> copies;
    const int reach = std::min(radius * step, border);
    const auto add = [&](int x) {
        if (const int from = reflected(x, step, width_); from >= 0) copies.push_back({x, from});
    };
    for (int x = -reach; x < 0; ++x) add(x);
    for (int x = width_; x < width_ + reach; ++x) add(x);

#pragma omp parallel for schedule(static) if (worth_threads())
    for (int line = 0; line < count_ * height_; ++line) {
        float* pixel = row(line / height_, line % height_);
        for (const Copy& copy : copies) pixel[copy.to] = pixel[copy.from];
    }
}

}  // namespace lab
