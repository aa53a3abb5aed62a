#include "lab/vertex_sums.h"

#include <algorithm>
#include <bit>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/vertex_sums.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Integers = hn::Rebind<std::int64_t, Doubles>;
using Floats = hn::Rebind<float, Doubles>;

// Adding it to a number under 2^51 rounds that to an integer, as llrint does, and leaves the integer in the low bits.
[[maybe_unused]] constexpr double rounder = 0x1.8p52;

template <class Number>
struct Adder;

template <>
struct Adder<FixedPoint> {
    using Vec = hn::Vec<Integers>;
    static Vec zero() { return hn::Zero(Integers()); }
#if HWY_TARGET == HWY_AVX3
    static Vec add(Vec sum, hn::Vec<Floats> terms) { return hn::Add(sum, Vec{_mm512_cvtps_epi64(terms.raw)}); }
    static constexpr std::uint64_t extra = 0;
#else
    static Vec add(Vec sum, hn::Vec<Floats> terms) {
        const Doubles d;
        return hn::Add(sum, hn::BitCast(Integers(), hn::Add(hn::PromoteTo(d, terms), hn::Set(d, rounder))));
    }
    static constexpr std::uint64_t extra = std::bit_cast<std::uint64_t>(rounder);
#endif
    static void store(Vec sum, std::uint32_t terms, std::int64_t* to) {
        const Integers d;
        const auto all_extra = hn::Set(d, static_cast<std::int64_t>(terms * extra));
        hn::Store(hn::Add(hn::Load(d, to), hn::Sub(sum, all_extra)), d, to);
    }
};

template <>
struct Adder<FloatingPoint> {
    using Vec = hn::Vec<Doubles>;
    static Vec zero() { return hn::Zero(Doubles()); }
    static Vec add(Vec sum, hn::Vec<Floats> terms) { return hn::Add(sum, hn::PromoteTo(Doubles(), terms)); }
    static void store(Vec sum, std::uint32_t, double* to) {
        const Doubles d;
        hn::Store(hn::Add(hn::Load(d, to), sum), d, to);
    }
};

// Lanes of the position's columns that see the far face, by corner.
alignas(64) constexpr float sees_far[corners][8] = {
    {0, 0, 0, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0}, {0, 1, 0, 0, 0, 1, 0, 0}, {1, 1, 0, 0, 1, 1, 0, 0},
    {0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 1, 0, 1, 0, 1, 0}, {0, 1, 1, 0, 0, 1, 1, 0}, {1, 1, 1, 0, 1, 1, 1, 0},
};

// Adds as many columns as a vector has lanes, from `first` on, of all corners: their sums stay in registers.
template <int first, class Number, std::size_t... corner>
void add_columns(const LightTerms* lights, const CellRun<Number>& run, std::index_sequence<corner...>) {
    using Sums = Adder<Number>;
    const Floats f;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(Doubles()));
    typename Sums::Vec sum[corners] = {(static_cast<void>(corner), Sums::zero())...};
    if constexpr (first >= column::position) {
        constexpr int at = first - column::position;
        const auto far = [&](std::size_t c) { return hn::Gt(hn::Load(f, sees_far[c] + at), hn::Zero(f)); };
        const hn::Mask<Floats> see_far[corners] = {far(corner)...};
        for (const LightTerms* light = lights + run.begin; light != lights + run.end; ++light) {
            const auto near_place = hn::Load(f, light->place[0] + at), far_place = hn::Load(f, light->place[1] + at);
            ((sum[corner] = Sums::add(sum[corner], hn::Mul(hn::Set(f, light->moment_weight[corner]),
                                                           hn::IfThenElse(see_far[corner], far_place, near_place)))),
             ...);
        }
    } else {
        const auto by_weight = hn::FirstN(f, column::moment_weight);
        const auto factor = [&](const LightTerms* light, std::size_t c) {
            if constexpr (first + lanes <= column::moment_weight) return hn::Set(f, light->weight[c]);
            if constexpr (first >= column::moment_weight) return hn::Set(f, light->moment_weight[c]);
            return hn::IfThenElse(by_weight, hn::Set(f, light->weight[c]), hn::Set(f, light->moment_weight[c]));
        };
        for (const LightTerms* light = lights + run.begin; light != lights + run.end; ++light) {
            const auto term = hn::Load(f, light->term + first);
            ((sum[corner] = Sums::add(sum[corner], hn::Mul(factor(light, corner), term))), ...);
        }
    }
    (Sums::store(sum[corner], run.end - run.begin, run.row[corner]->sum + first), ...);
}

template <class Number, std::size_t... group>
void add_groups(const LightTerms* lights, const CellRun<Number>& run, std::index_sequence<group...>) {
    constexpr int lanes = static_cast<int>(hn::MaxLanes(Doubles()));
    (add_columns<static_cast<int>(group) * lanes>(lights, run, std::make_index_sequence<corners>()), ...);
}

template <class Number>
void add_cells(const LightTerms* lights, const CellRun<Number>* runs, std::size_t count) {
    constexpr std::size_t groups = column::count / hn::MaxLanes(Doubles());
    for (std::size_t i = 0; i < count; ++i) add_groups(lights, runs[i], std::make_index_sequence<groups>());
}

void AddFixed(const LightTerms* lights, const CellRun<FixedPoint>* runs, std::size_t count) {
    add_cells(lights, runs, count);
}

void AddFloating(const LightTerms* lights, const CellRun<FloatingPoint>* runs, std::size_t count) {
    add_cells(lights, runs, count);
}

using Four = hn::FixedTag<float, 4>;
using Four4 = hn::Vec<Four>;

// `count` numbers in the first lanes. Where another light follows, its first numbers come along: quicker to read, and
// of no use. What follows the last one is for other threads to write.
template <int count>
HWY_INLINE Four4 load(const float* numbers, bool another_follows) {
    if (another_follows) return hn::LoadU(Four(), numbers);
    alignas(16) float own[4] = {};
    std::copy_n(numbers, count, own);
    return hn::Load(Four(), own);
}

HWY_INLINE Four4 nothing_before_face(const LevelSource& source, std::size_t i, const TermSettings& settings,
                                     Four4 near) {
    Trilinear at(settings.grid, source.lights.position[i], settings.level);
    at.end_before_far_face(source.lights.vertex[i], 1 << (settings.level - 1));
    alignas(16) float factor[4];
    hn::Store(near, Four(), factor);
    for (int axis = 0; axis < 3; ++axis)
        if (at.factor[0][axis] == 0.0f) factor[axis] = 0.0f;
    return hn::Load(Four(), factor);
}

// As Trilinear, four lanes at a time.
void PrepareTerms(const LevelSource& source, const TermSettings& settings, const std::uint32_t* index,
                  std::size_t count, LightTerms* out) {
    const Four d;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), scale = hn::Set(d, source.flux_scale);
    const auto inverse = hn::Set(d, 1.0f / settings.grid.cell_size(settings.level));
    const auto last = hn::Set(d, static_cast<float>(settings.grid.cells(settings.level) - 1));
    const auto first_lane = hn::FirstN(d, 1), three_lanes = hn::FirstN(d, 3);
    alignas(16) const float corner[4] = {settings.grid.origin.x, settings.grid.origin.y, settings.grid.origin.z, 0.0f};
    const auto origin = hn::Load(d, corner);
    const bool carry = source.s1() && settings.carry_moments;
    const auto unit = hn::Set(d, source.s1() ? 1.0f : 0x1p32f);  // exact: a power of two
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t i = source.first + index[k];
        const bool another = index[k] + 1 < source.count;
        const auto vector = [&](const Buffer<vec3>& of) HWY_ATTR { return load<3>(&of[i].x, another); };
        LightTerms& light = out[k];
        const auto u = hn::Mul(hn::Sub(vector(source.lights.position), origin), inverse);
        const auto cell = hn::Min(hn::Max(hn::Floor(u), zero), last);
        const auto far = hn::IfThenElseZero(three_lanes, hn::Min(hn::Max(hn::Sub(u, cell), zero), one));
        auto near = hn::Sub(one, far);
        if (source.half_open) near = nothing_before_face(source, i, settings, near);

        auto spread = zero;  // law of total variance
        if (carry) {
            const auto deviation = hn::Mul(vector(source.lights.deviation), inverse);
            spread = hn::IfThenElseZero(three_lanes, hn::Mul(deviation, deviation));
        }
        const auto before = hn::Sub(far, one);  // seen from the far face
        hn::Store(far, d, light.place[0]);
        hn::Store(hn::Add(hn::Mul(far, far), spread), d, light.place[0] + 4);
        hn::Store(before, d, light.place[1]);
        hn::Store(hn::Add(hn::Mul(before, before), spread), d, light.place[1] + 4);

        const auto flux = hn::Div(vector(source.lights.flux), scale);
        const auto weight = carry ? hn::Set(d, source.weight[index[k]]) : one;
        hn::Store(hn::IfThenElse(three_lanes, flux, weight), d, light.term);
        const auto normal = hn::ShiftLeftLanes<1>(d, vector(source.lights.normal));
        hn::Store(hn::IfThenElse(first_lane, one, normal), d, light.term + 4);
        const float* moment = &source.lights.normal_moment[i].xx;
        hn::Store(hn::LoadU(d, moment), d, light.term + 8);
        const auto oriented = hn::Set(d, static_cast<float>(source.lights.oriented[i] != 0));
        hn::Store(hn::ConcatLowerLower(d, hn::IfThenElseZero(first_lane, oriented), load<2>(moment + 4, another)), d,
                  light.term + 12);

        auto each = weight;
        if (settings.by_luminance) {  // as luminance()
            alignas(16) constexpr float share[4] = {0.2126f, 0.7152f, 0.0722f, 0.0f};
            const auto parts = hn::Mul(hn::Load(d, share), flux);
            each = hn::Add(hn::Add(hn::Broadcast<0>(parts), hn::Broadcast<1>(parts)), hn::Broadcast<2>(parts));
        }
        const auto both = hn::InterleaveLower(d, near, far);  // near x, far x, near y, far y
        const auto in_plane = hn::Mul(hn::ConcatLowerLower(d, both, both), hn::InterleaveUpper(d, both, both));
        const auto near_weight = hn::Mul(hn::Mul(in_plane, hn::Broadcast<2>(near)), unit);
        const auto far_weight = hn::Mul(hn::Mul(in_plane, hn::Broadcast<2>(far)), unit);
        hn::Store(near_weight, d, light.weight);
        hn::Store(far_weight, d, light.weight + 4);
        hn::Store(hn::Mul(near_weight, each), d, light.moment_weight);
        hn::Store(hn::Mul(far_weight, each), d, light.moment_weight + 4);
    }
}

template <class Number>
void finish(const VertexRow<Number>* rows, const Vertex* vertices, std::size_t count, const TermSettings& settings,
            float flux_scale, LightArrays& out, std::size_t first, float* weight) {
    constexpr bool fixed = std::is_same_v<Number, FixedPoint>;
    const double size = settings.grid.cell_size(settings.level);
    const glm::dvec3 origin(settings.grid.origin);
    for (std::size_t k = 0; k < count; ++k) {
        double sum[column::count];
        for (int c = 0; c < column::count; ++c)
            sum[c] = fixed ? static_cast<double>(rows[k].sum[c]) * 0x1p-32 : static_cast<double>(rows[k].sum[c]);
        const double total = sum[column::moment_weight], inverse = total > 0 ? 1.0 / total : 0.0;
        const double at[3] = {static_cast<double>(vertices[k].x), static_cast<double>(vertices[k].y),
                              static_cast<double>(vertices[k].z)};
        const std::size_t i = first + k;
        for (int c = 0; c < 3; ++c) {
            const double mean = sum[column::position + c] * inverse, square = sum[column::square + c] * inverse;
            const double variance = square - mean * mean;
            out.flux[i][c] = static_cast<float>(sum[column::flux + c] * flux_scale);
            out.position[i][c] = static_cast<float>(origin[c] + (at[c] + mean) * size);
            out.deviation[i][c] = static_cast<float>(std::sqrt(variance > 0 ? variance : 0.0) * size);
            out.normal[i][c] = static_cast<float>(sum[column::normal + c] * inverse);
        }
        const double* moment = sum + column::normal_moment;
        out.normal_moment[i] = {static_cast<float>(moment[0] * inverse), static_cast<float>(moment[1] * inverse),
                                static_cast<float>(moment[2] * inverse), static_cast<float>(moment[3] * inverse),
                                static_cast<float>(moment[4] * inverse), static_cast<float>(moment[5] * inverse)};
        out.vertex[i] = vertices[k];
        out.oriented[i] = sum[column::oriented] > 0;
        if (weight) weight[k] = static_cast<float>(sum[column::weight]);
    }
}

void FinishFixed(const VertexRow<FixedPoint>* rows, const Vertex* vertices, std::size_t count,
                 const TermSettings& settings, float flux_scale, LightArrays& out, std::size_t first, float* weight) {
    finish(rows, vertices, count, settings, flux_scale, out, first, weight);
}

void FinishFloating(const VertexRow<FloatingPoint>* rows, const Vertex* vertices, std::size_t count,
                    const TermSettings& settings, float flux_scale, LightArrays& out, std::size_t first,
                    float* weight) {
    finish(rows, vertices, count, settings, flux_scale, out, first, weight);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(AddFixed);
HWY_EXPORT(AddFloating);
HWY_EXPORT(PrepareTerms);
HWY_EXPORT(FinishFixed);
HWY_EXPORT(FinishFloating);

}  // namespace

void prepare_terms(const LevelSource& source, const TermSettings& settings, std::span<const std::uint32_t> index,
                   LightTerms* out) {
    HWY_DYNAMIC_DISPATCH(PrepareTerms)(source, settings, index.data(), index.size(), out);
}

void add_cells(const LightTerms* lights, std::span<const CellRun<FixedPoint>> runs) {
    HWY_DYNAMIC_DISPATCH(AddFixed)(lights, runs.data(), runs.size());
}

void add_cells(const LightTerms* lights, std::span<const CellRun<FloatingPoint>> runs) {
    HWY_DYNAMIC_DISPATCH(AddFloating)(lights, runs.data(), runs.size());
}

void finish_lights(std::span<const VertexRow<FixedPoint>> rows, std::span<const Vertex> vertices,
                   const TermSettings& settings, float flux_scale, LightArrays& out, std::size_t first, float* weight) {
    HWY_DYNAMIC_DISPATCH(FinishFixed)
    (rows.data(), vertices.data(), rows.size(), settings, flux_scale, out, first, weight);
}

void finish_lights(std::span<const VertexRow<FloatingPoint>> rows, std::span<const Vertex> vertices,
                   const TermSettings& settings, float flux_scale, LightArrays& out, std::size_t first, float* weight) {
    HWY_DYNAMIC_DISPATCH(FinishFloating)
    (rows.data(), vertices.data(), rows.size(), settings, flux_scale, out, first, weight);
}

}  // namespace lab
#endif
