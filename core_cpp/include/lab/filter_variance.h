// The variance-guided a-trous filter: how far two pixels' values may differ and still be mixed is measured from the
// noise itself, so that it smooths noise and keeps what is truly dark next to what is bright.
#pragma once

#include "lab/filter_planes.h"

namespace lab {

// Geometry guides of a pixel: normal x y z and position x y z over their sigmas, then 0 on surfaces and `never` on
// background.
inline constexpr int variance_guides = 7;

// Filters `signal` in place: `numerators` planes over the rest, as many denominators or one. `scale`: what a value
// (numerator over denominator) of ordinary size is. `tolerance`: differences are measured in units of so many standard
// deviations. After Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, without its temporal part.
void filter_by_variance(Planes& signal, int numerators, float scale, float tolerance, Planes& geometry);

}  // namespace lab
