#include "lab/filter_variance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lab/filter_weights.h"
#include "lab/luminance.h"
#include "lab/select.h"

namespace lab {
namespace {

constexpr int chunk = 256, most_planes = 6;
constexpr float least_deviation = 0.02f;  // relative to `scale`: smaller differences never stop the filter
constexpr float largest = 1e9f;           // relative to `scale`: larger values count as this where they guide
constexpr float any_difference = 1e9f;    // with such a tolerance values stop nothing, not even where there is no noise
constexpr float unlike = 20.0f;           // likeness of 2^-20 and less is none: nothing is known from such pixels
constexpr float log2_e = 1.44269504f;
// Gaussian of sigma 1 over -2..2, and the passes' steps.
constexpr std::array<float, 5> kernel{0.0544886845f, 0.2442013420f, 0.4026199469f, 0.2442013420f, 0.0544886845f};
constexpr std::array<int, 5> steps{1, 2, 4, 8, 16};

struct Row {
    int x, count, y;
};

// 2^-distance between pixels p of a row and their taps q in row y_q, shifted: by geometry alone the likeness of their
// surfaces, with a guide by their values, too.
class TapWeights {
  public:
    TapWeights(const Planes& geometry, const Planes* guide) : geometry_(geometry), guide_(guide) {}

    // `space`: the tap's spatial weight, with a guide.
    void weigh(const Row& row, int y_q, int shift, float space, float* weight) const {
        std::array<const float*, variance_guides> p, q;
        for (int i = 0; i < variance_guides; ++i) {
            p[i] = geometry_.row(i, row.y) + row.x;
            q[i] = geometry_.row(i, y_q) + row.x + shift;
        }
#pragma omp simd
        for (int i = 0; i < row.count; ++i) {
            const float a = q[0][i] - p[0][i], b = q[1][i] - p[1][i], c = q[2][i] - p[2][i];
            const float x = q[3][i] - p[3][i], y = q[4][i] - p[4][i], z = q[5][i] - p[5][i];
            weight[i] = a * a + b * b + c * c + x * x + y * y + z * z + p[6][i] + q[6][i];
        }
        if (guide_) {
            const float *value_p = guide_->row(0, row.y) + row.x, *value_q = guide_->row(0, y_q) + row.x + shift;
            const float* per_deviation = guide_->row(1, row.y) + row.x;
#pragma omp simd
            for (int i = 0; i < row.count; ++i) weight[i] += magnitude(value_q[i] - value_p[i]) * per_deviation[i];
#pragma omp simd
            for (int i = 0; i < row.count; ++i) weight[i] = space * exp2_negative(weight[i]);
        } else {
#pragma omp simd
            for (int i = 0; i < row.count; ++i) weight[i] = weight[i] < unlike ? exp2_negative(weight[i]) : 0.0f;
        }
    }

  private:
    const Planes& geometry_;
    const Planes* guide_;
};

class VarianceFilter {
  public:
    VarianceFilter(Planes& signal, int numerators, float scale, float tolerance, Planes& geometry)
        : signal_(signal),
          geometry_(geometry),
          numerators_(numerators),
          scale_(scale),
          tolerance_(tolerance),
          value_(signal.width(), signal.height(), 2),
          variance_(signal.width(), signal.height(), 1),
          guide_(signal.width(), signal.height(), 2) {}

    void run() {
        Planes filtered = signal_, filtered_variance = variance_;
        per_denominator_ = one_over_mean_denominator();
        take_values();
        reflect(1, {&value_, &geometry_});
        for_rows([&](const Row& row) { measure_variance(row); });
        for (const int step : steps) {
            if (step > 1) take_values();
            reflect(1, {&value_, &variance_, &geometry_});
            for_rows([&](const Row& row) { make_guide(row, step == 1 ? 1 : 0); });
            reflect(step, {&signal_, &variance_, &guide_, &geometry_});
            for_rows([&](const Row& row) { pass(row, step, filtered, filtered_variance); });
            std::swap(signal_, filtered);
            std::swap(variance_, filtered_variance);
        }
    }

  private:
    Planes &signal_, &geometry_;
    int numerators_;
    float scale_, tolerance_;
    double per_denominator_ = 1;
    Planes value_;     // luminances of numerator (over `scale`) and denominator, both over the mean denominator
    Planes variance_;  // of a pixel's value
    Planes guide_;     // value; log2(e) over the deviation that is tolerated around it

    template <class Work>
    void for_rows(const Work& work) {
#pragma omp parallel for schedule(dynamic, 8) if (signal_.worth_threads())
        for (int y = 0; y < signal_.height(); ++y)
            for (int x = 0; x < signal_.width(); x += chunk) work(Row{x, std::min(chunk, signal_.width() - x), y});
    }

    void reflect(int step, std::initializer_list<Planes*> planes) {
        for (Planes* p : planes) p->reflect_sides(step, 2);
    }

    // Calls visit(y_q, shift, weights) for the taps of a square window around a row of pixels; the centre's weight is
    // its spatial one.
    template <class Visit>
    void taps(const Row& row, int radius, int step, const Planes* guide, const float* space, const Visit& visit) {
        const TapWeights weights(geometry_, guide);
        float weight[chunk];
        for (int dy = -radius; dy <= radius; ++dy) {
            const int y = reflected(row.y + dy * step, step, signal_.height());
            for (int dx = -radius; dx <= radius; ++dx) {
                const float w = space ? space[dy + radius] * space[dx + radius] : 1.0f;
                if (dx == 0 && dy == 0)
                    std::fill_n(weight, row.count, w);
                else
                    weights.weigh(row, y, dx * step, w, weight);
                visit(y, dx * step, weight);
            }
        }
    }

    float bright(int y, int x, int first, int count) const {
        if (count == 1) return signal_.row(first, y)[x];
        return luminance({signal_.row(first, y)[x], signal_.row(first + 1, y)[x], signal_.row(first + 2, y)[x]});
    }

    float bright_denominator(int y, int x) const { return bright(y, x, numerators_, signal_.count() - numerators_); }

    // In such units no sum and no square leaves float's range, whatever the light's. A power of two rounds nothing.
    double one_over_mean_denominator() const {
        double sum = 0;
        for (int y = 0; y < signal_.height(); ++y)
            for (int x = 0; x < signal_.width(); ++x) sum += std::max(0.0f, bright_denominator(y, x));
        const double mean = sum / (static_cast<double>(signal_.width()) * signal_.height());
        return mean > 0 ? std::ldexp(1.0, -std::ilogb(mean)) : 1.0;
    }

    void take_values() {
        for_rows([&](const Row& row) {
            for (int x = row.x; x < row.x + row.count; ++x) {
                const double over = bright(row.y, x, 0, numerators_) * per_denominator_ / scale_;
                const double under = bright_denominator(row.y, x) * per_denominator_;
                value_.row(0, row.y)[x] = static_cast<float>(std::clamp(over, 0.0, double{largest}));
                value_.row(1, row.y)[x] = static_cast<float>(std::clamp(under, 0.0, double{largest}));
            }
        });
    }

    // How much single pixels' values scatter around their mean, over the like pixels of a 5 x 5 window.
    void measure_variance(const Row& row) {
        float likeness[25][chunk], sum[chunk]{}, s[chunk]{}, u[chunk]{}, scatter[chunk]{};
        int tap = 0;
        taps(row, 2, 1, nullptr, nullptr, [&](int y, int shift, const float* weight) {
            const float *a = value_.row(0, y) + row.x + shift, *b = value_.row(1, y) + row.x + shift;
            float* like = likeness[tap++];
#pragma omp simd
            for (int i = 0; i < row.count; ++i) {
                like[i] = weight[i];
                sum[i] += weight[i];
                s[i] += weight[i] * a[i];
                u[i] += weight[i] * b[i];
            }
        });
        float* mean = s;
        for (int i = 0; i < row.count; ++i) mean[i] = u[i] > 0 ? s[i] / u[i] : 0.0f;
        // A second time, around the mean: a difference of sums of squares would leave little of values nearly alike.
        tap = 0;
        for (int dy = -2; dy <= 2; ++dy) {
            const int y = reflected(row.y + dy, 1, signal_.height());
            for (int dx = -2; dx <= 2; ++dx) {
                const float *a = value_.row(0, y) + row.x + dx, *b = value_.row(1, y) + row.x + dx;
                const float* like = likeness[tap++];
#pragma omp simd
                for (int i = 0; i < row.count; ++i) {
                    const float off = a[i] - mean[i] * b[i];
                    scatter[i] += like[i] * off * off;
                }
            }
        }
        float* variance = variance_.row(0, row.y) + row.x;
        for (int i = 0; i < row.count; ++i)
            variance[i] = u[i] > 0 ? smaller(scatter[i] * sum[i] / (u[i] * u[i]), largest * largest) : 0.0f;
    }

    // The values as measured are too noisy to guide the first pass: it looks at their mean over 3 x 3 pixels.
    void make_guide(const Row& row, int radius) {
        float sum[chunk]{}, s[chunk]{}, u[chunk]{}, v[chunk]{};
        taps(row, radius, 1, nullptr, nullptr, [&](int y, int shift, const float* weight) {
            const float *a = value_.row(0, y) + row.x + shift, *b = value_.row(1, y) + row.x + shift;
            const float* c = variance_.row(0, y) + row.x + shift;
#pragma omp simd
            for (int i = 0; i < row.count; ++i) {
                sum[i] += weight[i];
                s[i] += weight[i] * a[i];
                u[i] += weight[i] * b[i];
                v[i] += weight[i] * c[i];
            }
        });
        float *value = guide_.row(0, row.y) + row.x, *per_deviation = guide_.row(1, row.y) + row.x;
        for (int i = 0; i < row.count; ++i) {
            const bool known = u[i] > 0;
            value[i] = known ? smaller(s[i] / u[i], largest) : 0.0f;
            // Where no sample says anything around, any neighbour's word is welcome.
            const bool stops = known && tolerance_ < any_difference;
            per_deviation[i] = stops ? log2_e / (tolerance_ * std::sqrt(v[i] / sum[i]) + least_deviation) : 0.0f;
        }
    }

    // What is summed is the difference to the pixel's own value: a constant stays exact.
    void pass(const Row& row, int step, Planes& out, Planes& variance_out) {
        float sum[chunk]{}, variance[chunk]{}, change[most_planes][chunk]{};
        taps(row, 2, step, &guide_, kernel.data(), [&](int y, int shift, const float* weight) {
            const float* v = variance_.row(0, y) + row.x + shift;
#pragma omp simd
            for (int i = 0; i < row.count; ++i) {
                sum[i] += weight[i];
                variance[i] += weight[i] * weight[i] * v[i];
            }
            for (int c = 0; c < signal_.count(); ++c) {
                const float *p = signal_.row(c, row.y) + row.x, *q = signal_.row(c, y) + row.x + shift;
                float* difference = change[c];
#pragma omp simd
                for (int i = 0; i < row.count; ++i) difference[i] += weight[i] * (q[i] - p[i]);
            }
        });
        for (int c = 0; c < signal_.count(); ++c) {
            const float* p = signal_.row(c, row.y) + row.x;
            float* filtered = out.row(c, row.y) + row.x;
#pragma omp simd
            for (int i = 0; i < row.count; ++i) filtered[i] = p[i] + change[c][i] / sum[i];
        }
        float* filtered = variance_out.row(0, row.y) + row.x;
#pragma omp simd
        for (int i = 0; i < row.count; ++i) filtered[i] = variance[i] / (sum[i] * sum[i]);
    }
};

}  // namespace

void filter_by_variance(Planes& signal, int numerators, float scale, float tolerance, Planes& geometry) {
    VarianceFilter(signal, numerators, scale, tolerance, geometry).run();
}

}  // namespace lab
