#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/filter_variance.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: these are compiled for each instruction set.
#include <algorithm>
#include <cmath>

#include "lab/filter_pairs.h"
#include "lab/filter_units.h"
#include "lab/filter_variance.h"

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

// What the kernels share: a pixel's signals begin at `at`, its planes lie `stride` apart.
class Reader {
  public:
    Reader(const Planes& planes, const Units& units) : units_(units), stride_(planes.stride()) {}

    Vector load(const float* at, int plane) const { return hn::LoadU(Lanes(), at + plane * stride_); }

    // Luminance of the signals from `first` on.
    HWY_INLINE Vector bright(const float* at, int first, int count) const {
        if (count == 1) return load(at, first);
        return luminance(load(at, first), load(at, first + 1), load(at, first + 2));
    }
    HWY_INLINE Vector over(const float* at) const { return scaled(bright(at, 0, units_.numerators), units_.over); }
    HWY_INLINE Vector under(const float* at) const {
        return scaled(bright(at, units_.numerators, units_.denominators), units_.under);
    }

  private:
    const Units& units_;
    std::size_t stride_;

    static HWY_INLINE Vector scaled(Vector v, const Factor& factor) {
        const Lanes f32;
        const auto product = hn::Mul(hn::Mul(v, hn::Set(f32, factor.power)), hn::Set(f32, factor.rest));
        return hn::Min(hn::Max(product, hn::Zero(f32)), hn::Set(f32, largest));
    }
};

double denominator_sum(const Planes& signal, const Units& units, int y) {
    const Lanes f32;
    const hn::Rebind<double, hn::Half<Lanes>> f64;
    const Reader read(signal, units);
    const int lanes = static_cast<int>(hn::Lanes(f32));
    auto sum = hn::Zero(f64);
    int x = 0;
    for (; x + lanes <= signal.width(); x += lanes) {
        const auto v = hn::Max(read.bright(signal.row(0, y) + x, units.numerators, units.denominators), hn::Zero(f32));
        sum = hn::Add(sum, hn::PromoteTo(f64, hn::LowerHalf(v)));
        sum = hn::Add(sum, hn::PromoteTo(f64, hn::UpperHalf(hn::Half<Lanes>(), v)));
    }
    double total = hn::GetLane(hn::SumOfLanes(f64, sum));
    if (x < signal.width()) {
        float rest[Planes::slack] = {};
        hn::StoreU(read.bright(signal.row(0, y) + x, units.numerators, units.denominators), f32, rest);
        for (int i = 0; x + i < signal.width(); ++i) total += std::max(rest[i], 0.0f);
    }
    return total;
}

// Luminances of numerator and denominator, to where value and deviation will be.
void take_luminances(const Planes& in, const Units& units, int y, Planes& out) {
    const Lanes f32;
    const Reader read(in, units);
    for (int x = 0; x < in.width(); x += static_cast<int>(hn::Lanes(f32))) {
        const float* at = in.row(0, y) + x;
        hn::Store(read.over(at), f32, out.row(units.value(), y) + x);
        hn::Store(read.under(at), f32, out.row(units.per_deviation(), y) + x);
    }
}

// Stores the guide: the mean value, and how far others may be from it. s, u: numerator and denominator.
HWY_INLINE void store_guide(Vector s, Vector u, Vector variance, float tolerance, float* value, float* per_deviation) {
    const Lanes f32;
    const auto known = hn::Gt(u, hn::Zero(f32));
    hn::Store(hn::IfThenElseZero(known, hn::Min(hn::Div(s, u), hn::Set(f32, largest))), f32, value);
    if (tolerance >= any_difference) return hn::Store(hn::Zero(f32), f32, per_deviation);
    const auto tolerated = hn::MulAdd(hn::Set(f32, tolerance), hn::Sqrt(variance), hn::Set(f32, least_deviation));
    // Where no sample says anything around, any neighbour's word is welcome.
    hn::Store(hn::IfThenElseZero(known, hn::Div(hn::Set(f32, log2_e), tolerated)), f32, per_deviation);
}

// Filters a strip by the likeness of pairs of surfaces, 0 to 1.
template <int radius, class Mix>
HWY_INLINE void by_likeness(const Strip& strip, const Planes& surfaces, PairRows& pairs, const Mix& mix) {
    const auto row_of = [&](int y) { return SurfaceGuide::Row{surfaces.row(0, y), surfaces.stride()}; };
    const auto likeness = [](const auto& p, const auto& q, float)
                              LAB_INLINE { return exp2_negative(p.distance(q, hn::Zero(Lanes())), unlike); };
    for_blocks<radius, SurfaceGuide>(strip, pairs, row_of, likeness, mix);
}

// How much single pixels' values scatter around their mean, over the like pixels of a 5 x 5 window. `luminances`: see
// take_luminances.
void measure_variance(const Planes& luminances, const Planes& surfaces, const Units& units, const Strip& strip,
                      PairRows& pairs, Planes& out) {
    const Lanes f32;
    const std::size_t stride = luminances.stride();
    by_likeness<2>(strip, surfaces, pairs, [&](int j, auto lines) {
        const Windows<lines, 2> windows(strip, j, pairs, luminances, units.value(), 2);
        for (int x = 0; x < strip.x1 - strip.x0; x += static_cast<int>(hn::Lanes(f32))) {
            windows.prefetch(x);
            Vector a[lines], b[lines], sum[lines], s[lines], u[lines], mean[lines], scatter[lines];
            for (int i = 0; i < lines; ++i) {
                const float* own = luminances.row(units.value(), strip.row(j + i)) + strip.x0 + x;
                a[i] = s[i] = hn::Load(f32, own);
                b[i] = u[i] = hn::Load(f32, own + stride);
                sum[i] = hn::Set(f32, 1.0f);
            }
            windows.visit(x, [&](const float* at, const auto& each) LAB_INLINE {
                const auto q_over = hn::LoadU(f32, at), q_under = hn::LoadU(f32, at + stride);
                each([&](int i, Vector like) LAB_INLINE {
                    sum[i] = hn::Add(sum[i], like);
                    s[i] = hn::MulAdd(like, q_over, s[i]);
                    u[i] = hn::MulAdd(like, q_under, u[i]);
                });
            });
            for (int i = 0; i < lines; ++i) {
                mean[i] = hn::IfThenElseZero(hn::Gt(u[i], hn::Zero(f32)), hn::Div(s[i], u[i]));
                const auto off = hn::NegMulAdd(mean[i], b[i], a[i]);
                scatter[i] = hn::Mul(off, off);
            }
            // A second time, around the mean: a difference of sums of squares would leave little of values nearly
            // alike.
            windows.visit(x, [&](const float* at, const auto& each) LAB_INLINE {
                const auto q_over = hn::LoadU(f32, at), q_under = hn::LoadU(f32, at + stride);
                each([&](int i, Vector like) LAB_INLINE {
                    const auto off = hn::NegMulAdd(mean[i], q_under, q_over);
                    scatter[i] = hn::MulAdd(like, hn::Mul(off, off), scatter[i]);
                });
            });
            for (int i = 0; i < lines; ++i) {
                const auto spread = hn::Div(hn::Mul(scatter[i], sum[i]), hn::Mul(u[i], u[i]));
                const auto known =
                    hn::IfThenElseZero(hn::Gt(u[i], hn::Zero(f32)), hn::Min(spread, hn::Set(f32, largest * largest)));
                hn::Store(known, f32, out.row(units.variance(), strip.row(j + i)) + strip.x0 + x);
            }
        }
    });
}

// The values as measured are too noisy to guide the first pass: it looks at their mean over 3 x 3 pixels.
void make_first_guide(const Planes& luminances, const Planes& surfaces, const Units& units, const Strip& strip,
                      PairRows& pairs, Planes& in) {
    const Lanes f32;
    const std::size_t stride = in.stride();
    const float *from = luminances.row(units.value(), 0), *variance = in.row(units.variance(), 0);
    by_likeness<1>(strip, surfaces, pairs, [&](int j, auto lines) {
        const Windows<lines, 1> windows(strip, j, pairs, luminances, units.value(), 2);
        for (int x = 0; x < strip.x1 - strip.x0; x += static_cast<int>(hn::Lanes(f32))) {
            windows.prefetch(x);
            Vector sum[lines], s[lines], u[lines], v[lines];
            for (int i = 0; i < lines; ++i) {
                const int y = strip.row(j + i);
                const float* own = luminances.row(units.value(), y) + strip.x0 + x;
                sum[i] = hn::Set(f32, 1.0f);
                s[i] = hn::Load(f32, own);
                u[i] = hn::Load(f32, own + stride);
                v[i] = hn::Load(f32, variance + (own - from));
            }
            windows.visit(x, [&](const float* at, const auto& each) LAB_INLINE {
                const auto q_over = hn::LoadU(f32, at), q_under = hn::LoadU(f32, at + stride);
                const auto noise = hn::LoadU(f32, variance + (at - from));
                each([&](int i, Vector like) LAB_INLINE {
                    sum[i] = hn::Add(sum[i], like);
                    s[i] = hn::MulAdd(like, q_over, s[i]);
                    u[i] = hn::MulAdd(like, q_under, u[i]);
                    v[i] = hn::MulAdd(like, noise, v[i]);
                });
            });
            for (int i = 0; i < lines; ++i) {
                float* out = in.row(units.value(), strip.row(j + i)) + strip.x0 + x;
                store_guide(s[i], u[i], hn::Div(v[i], sum[i]), units.tolerance, out, out + stride);
            }
        }
    });
}

// Some lines of a pass, with the variance where another follows. What is summed is the difference to the pixel's own
// value: a constant stays exact.
template <int signals, bool another, int lines>
HWY_INLINE void mix_lines(const Strip& strip, int j, PairRows& pairs, const Planes& in, Planes& out) {
    const Lanes f32;
    const std::size_t stride = in.stride(), variance = signals * stride, guide = variance + stride;
    const Windows<lines, 2> windows(strip, j, pairs, in, 0, signals + 2);
    std::array<const float*, lines> own;
    std::array<float*, lines> filtered;
    for (int i = 0; i < lines; ++i) {
        own[i] = in.row(0, strip.row(j + i)) + strip.x0;
        filtered[i] = out.row(0, strip.row(j + i)) + strip.x0;
    }
    for (int x = 0; x < strip.x1 - strip.x0; x += static_cast<int>(hn::Lanes(f32))) {
        windows.prefetch(x);
        Vector p[lines][signals], change[lines][signals], value[lines], per_deviation[lines], sum[lines], spread[lines];
        for (int i = 0; i < lines; ++i) {
            for (int c = 0; c < signals; ++c) {
                p[i][c] = hn::Load(f32, own[i] + c * stride + x);
                change[i][c] = hn::Zero(f32);
            }
            value[i] = hn::Load(f32, own[i] + guide + x);
            per_deviation[i] = hn::Load(f32, own[i] + guide + stride + x);
            sum[i] = hn::Set(f32, 1.0f);
            spread[i] = hn::Load(f32, own[i] + variance + x);
        }
        windows.visit(x, [&](const float* at, const auto& each) LAB_INLINE {
            const auto q_value = hn::LoadU(f32, at + guide);
            Vector q[signals], noise;
            for (int c = 0; c < signals; ++c) q[c] = hn::LoadU(f32, at + c * stride);
            if constexpr (another) noise = hn::LoadU(f32, at + variance);
            each([&](int i, Vector surfaces) LAB_INLINE {
                const auto apart = hn::Abs(hn::Sub(q_value, value[i]));
                const auto weight = exp2_negative(hn::MulAdd(apart, per_deviation[i], surfaces));
                sum[i] = hn::Add(sum[i], weight);
                if constexpr (another) spread[i] = hn::MulAdd(hn::Mul(weight, weight), noise, spread[i]);
                for (int c = 0; c < signals; ++c)
                    change[i][c] = hn::MulAdd(weight, hn::Sub(q[c], p[i][c]), change[i][c]);
            });
        });
        for (int i = 0; i < lines; ++i) {
            for (int c = 0; c < signals; ++c)
                hn::Store(hn::Add(p[i][c], hn::Div(change[i][c], sum[i])), f32, filtered[i] + c * stride + x);
            if constexpr (another)
                hn::Store(hn::Div(spread[i], hn::Mul(sum[i], sum[i])), f32, filtered[i] + variance + x);
        }
    }
}

// One pass, and the guide of another that follows.
template <int signals, bool another>
void filter_signals(const Planes& in, const Planes& surfaces, const Units& units, const Strip& strip, PairRows& pairs,
                    Planes& out) {
    const Lanes f32;
    const Reader read(out, units);
    const auto row_of = [&](int y) { return SurfaceGuide::Row{surfaces.row(0, y), surfaces.stride()}; };
    const auto distance = [](const SurfaceGuide& p, const SurfaceGuide& q, float space)
                              LAB_INLINE { return p.distance(q, hn::Set(Lanes(), space)); };
    for_blocks<2, SurfaceGuide>(strip, pairs, row_of, distance, [&](int j, auto lines) {
        mix_lines<signals, another, lines>(strip, j, pairs, in, out);
        for (int i = 0; another && i < lines; ++i)
            for (int x = strip.x0; x < strip.x1; x += static_cast<int>(hn::Lanes(f32))) {
                float* at = out.row(0, strip.row(j + i)) + x;
                store_guide(read.over(at), read.under(at), read.load(at, units.variance()), units.tolerance,
                            at + units.value() * out.stride(), at + units.per_deviation() * out.stride());
            }
    });
}

void filter_strip(const Planes& in, const Planes& surfaces, const Units& units, const Strip& strip, PairRows& pairs,
                  Planes& out) {
    const bool another = strip.step != atrous_steps.back();
    const auto filter = units.signals() == 2   ? (another ? filter_signals<2, true> : filter_signals<2, false>)
                        : units.signals() == 4 ? (another ? filter_signals<4, true> : filter_signals<4, false>)
                                               : (another ? filter_signals<6, true> : filter_signals<6, false>);
    filter(in, surfaces, units, strip, pairs, out);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(denominator_sum);
HWY_EXPORT(take_luminances);
HWY_EXPORT(measure_variance);
HWY_EXPORT(make_first_guide);
HWY_EXPORT(filter_strip);

// A power of two, which rounds nothing.
double one_over_mean_denominator(const Planes& signal, const Units& units) {
    std::vector<double> sums(signal.height());
#pragma omp parallel for schedule(static) if (signal.worth_threads())
    for (int y = 0; y < signal.height(); ++y) sums[y] = HWY_DYNAMIC_DISPATCH(denominator_sum)(signal, units, y);
    double sum = 0;  // in one order, whatever the threads
    for (const double of_line : sums) sum += of_line;
    const double mean = sum / (static_cast<double>(signal.width()) * signal.height());
    return mean > 0 ? std::ldexp(1.0, -std::ilogb(mean)) : 1.0;
}

}  // namespace

void filter_by_variance(Planes& signal, int numerators, float scale, float tolerance, Planes& surfaces) {
    Planes other(signal.width(), signal.height(), signal.count());
    Units units{numerators, signal.count() - variance_planes - numerators, {}, {}, tolerance};
    const double per_denominator = one_over_mean_denominator(signal, units);
    units.over = Factor(per_denominator / scale);
    units.under = Factor(per_denominator);

#pragma omp parallel for schedule(static) if (signal.worth_threads())
    for (int y = 0; y < signal.height(); ++y) HWY_DYNAMIC_DISPATCH(take_luminances)(signal, units, y, other);
    for (Planes* planes : {&other, &surfaces}) planes->reflect_sides(1, 2);
    for_strips(signal, 1, [&](const Strip& strip, PairRows& pairs) {
        HWY_DYNAMIC_DISPATCH(measure_variance)(other, surfaces, units, strip, pairs, signal);
    });
    signal.reflect_sides(1, 1);
    for_strips(signal, 1, [&](const Strip& strip, PairRows& pairs) {
        HWY_DYNAMIC_DISPATCH(make_first_guide)(other, surfaces, units, strip, pairs, signal);
    });
    for (const int step : atrous_steps) {
        for (Planes* planes : {&signal, &surfaces}) planes->reflect_sides(step, 2);
        for_strips(signal, step, [&](const Strip& strip, PairRows& pairs) {
            HWY_DYNAMIC_DISPATCH(filter_strip)(signal, surfaces, units, strip, pairs, other);
        });
        std::swap(signal, other);
    }
}

}  // namespace lab
#endif
