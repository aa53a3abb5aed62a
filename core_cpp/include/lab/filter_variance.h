// The variance-guided a-trous filter: how far two pixels' values may differ and still be mixed is measured from the
// noise itself, so that it smooths noise and keeps what is truly dark next to what is bright.
#pragma once

#include "lab/filter_planes.h"

namespace lab {

// Planes that the filter needs beside a signal's, behind them: the variance of a pixel's value; the value that guides;
// log2(e) over the deviation that is tolerated around it.
inline constexpr int variance_planes = 3;

// Filters the signal in the first planes in place: `numerators` of them, then as many denominators or one. `scale`:
// what a value (numerator over denominator) of ordinary size is. `tolerance`: differences are measured in units of so
// many standard deviations. `surfaces`: see surface_guides. After Schied et al., "Spatiotemporal Variance-Guided
// Filtering", HPG 2017, without its temporal part.
void filter_by_variance(Planes& signal, int numerators, float scale, float tolerance, Planes& surfaces);

}  // namespace lab
