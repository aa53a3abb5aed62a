// What guides the edge-stopping filters: each pixel's surface, and the value of what is filtered.
#pragma once

#include "lab/filter_planes.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

// Weights are exp(-e) = 2^-t. Guides are stored times sqrt(log2(e) / 2), so that t is their squared distance.
inline constexpr float guide_scale = 0.849321800f;
inline constexpr float guide_limit = 1e18f;    // larger guides count as this: a squared distance stays finite
inline constexpr float weight_limit = 100.0f;  // 2^-100 and less is no weight
inline constexpr float value_limit = 1e30f;    // a ratio beyond it (S over a vanishing D) counts as this

// The spatial kernel's exponent, too: a Gaussian of sigma 1, over its weight in the middle.
inline constexpr float per_squared_offset = guide_scale * guide_scale;

// A guide's factor: 1 / (sigma unit). An infinite sigma drops the guide, a vanishing one stays finite.
double per_sigma(double sigma, double unit = 1.0);

// The guides that stay the same in every pass. Normal x y z and position x y z, over their sigmas; for atrous_plane as
// they are, and 1 / (sigma_plane footprint). Where a filter knows background, the position there is NaN: at no distance
// from anything, so that no tap from or to it has any weight.
Planes surface_guides(const GBufferView& gbuffer, const Params& params, double scene_radius);

}  // namespace lab
