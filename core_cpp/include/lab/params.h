// The settings as the C++ core sees them. lab/params.py is the truth: names, order and defaults here are
// compared with it by tests/repo/test_params_agree.py, words are turned into numbers by Params.to_core().
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace lab {

enum class Construction { gather, scatter };
enum class GatherRange { inclusive, half_open };
enum class CentreWeight { flux, count };
enum class LightingMode { tiled, raster };
enum class Lobe { moments, mean_energy, mean };
enum class Receiver { hard, soft };
enum class Falloff { clamped, softened };
enum class Compensation { none, path };
enum class Picker { reservoir, race };
enum class ReservoirLocks { none, locked, atomic_race };
enum class ShadowPoints { members, jitter };
enum class ShadowEstimator { ratio, average, ratio_rgb, corrected };
enum class Filter { atrous_variance, atrous, atrous_plane, bilateral, none };
enum class FilterBackend { fused, kornia };

// The words of each choice, in the order of its enumerators.
template <class Choice>
inline constexpr std::array<const char*, 0> words_of{};
template <>
inline constexpr std::array words_of<Construction>{"gather", "scatter"};
template <>
inline constexpr std::array words_of<GatherRange>{"inclusive", "half_open"};
template <>
inline constexpr std::array words_of<CentreWeight>{"flux", "count"};
template <>
inline constexpr std::array words_of<LightingMode>{"tiled", "raster"};
template <>
inline constexpr std::array words_of<Lobe>{"moments", "mean_energy", "mean"};
template <>
inline constexpr std::array words_of<Receiver>{"hard", "soft"};
template <>
inline constexpr std::array words_of<Falloff>{"clamped", "softened"};
template <>
inline constexpr std::array words_of<Compensation>{"none", "path"};
template <>
inline constexpr std::array words_of<Picker>{"reservoir", "race"};
template <>
inline constexpr std::array words_of<ReservoirLocks>{"none", "locked", "atomic_race"};
template <>
inline constexpr std::array words_of<ShadowPoints>{"members", "jitter"};
template <>
inline constexpr std::array words_of<ShadowEstimator>{"ratio", "average", "ratio_rgb", "corrected"};
template <>
inline constexpr std::array words_of<Filter>{"atrous_variance", "atrous", "atrous_plane", "bilateral", "none"};
template <>
inline constexpr std::array words_of<FilterBackend>{"fused", "kornia"};

inline constexpr int levels_auto = 0, levels_demo = -1;  // Params.levels beside 1..12
inline constexpr int max_levels = 12, max_shadow_samples = 64;
inline constexpr float no_bound = std::numeric_limits<float>::infinity();  // "none" of omega_max and the sigmas

// X(type, name, default)
#define LAB_PARAMS(X)                                               \
    X(std::int64_t, vpls, 100000)                                   \
    X(int, max_bounces, 3)                                          \
    X(float, bounds_scale, 1.0f)                                    \
    X(int, levels, levels_auto)                                     \
    X(Construction, construction, Construction::gather)             \
    X(GatherRange, gather_range, GatherRange::inclusive)            \
    X(bool, carry_moments, true)                                    \
    X(CentreWeight, centre_weight, CentreWeight::flux)              \
    X(LightingMode, lighting, LightingMode::tiled)                  \
    X(Lobe, lobe, Lobe::moments)                                    \
    X(Receiver, receiver, Receiver::hard)                           \
    X(float, alpha, 1.0f)                                           \
    X(int, first_level, 0)                                          \
    X(Falloff, falloff, Falloff::clamped)                           \
    X(float, clamp_distance, 0.01f)                                 \
    X(Compensation, compensation, Compensation::none)               \
    X(int, compensation_samples, 4)                                 \
    X(int, shadow_samples, 4)                                       \
    X(int, first_shadow_level, 0)                                   \
    X(bool, importance, true)                                       \
    X(Picker, picker, Picker::reservoir)                            \
    X(ReservoirLocks, reservoir_locks, ReservoirLocks::atomic_race) \
    X(ShadowPoints, shadow_points, ShadowPoints::members)           \
    X(float, deviation_scale, 0.5f)                                 \
    X(ShadowEstimator, shadow_estimator, ShadowEstimator::ratio)    \
    X(float, omega_max, 8.0f)                                       \
    X(int, member_candidates, 3)                                    \
    X(int, interleave, 1)                                           \
    X(bool, deal_all, false)                                        \
    X(Filter, filter, Filter::atrous_variance)                      \
    X(FilterBackend, filter_backend, FilterBackend::fused)          \
    X(float, sigma_deviation, 3.0f)                                 \
    X(float, sigma_shadow, 1.0f)                                    \
    X(float, sigma_normal, 0.25f)                                   \
    X(float, sigma_position, 0.01f)                                 \
    X(float, sigma_plane, 0.2f)                                     \
    X(int, direct_samples, 4)                                       \
    X(std::uint32_t, seed, 0)                                       \
    X(std::uint32_t, frame, 0)

struct Params {
#define LAB_FIELD(type, name, value) type name = value;
    LAB_PARAMS(LAB_FIELD)
#undef LAB_FIELD
};

}  // namespace lab
