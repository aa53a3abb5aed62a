"""The variance-guided a-trous filter in torch: the reference of the fused kernel, and backend ``kornia``.

How far two pixels' values may differ and still be mixed is measured from the noise itself. Values are compared over
the deviation that is tolerated around the *reading* pixel: p may read q where q does not read p. kornia's joint
bilateral blur weighs by a distance in one space for both, which can not say that, so these are shifted taps.
Source: Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, without its temporal part.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

from lab.filters_images import STEPS, at_tap, by_sub_images, luminance

if TYPE_CHECKING:
    from torch import Tensor

GAUSSIAN = (0.0544886845, 0.2442013420, 0.4026199469, 0.2442013420, 0.0544886845)  # sigma 1, sums to 1
LEAST_DEVIATION = 0.02  # relative to the scale: smaller differences never stop the filter
LARGEST = 1e9  # relative to the scale: larger values count as this where they guide
LEAST_LIKENESS = 2.0**-20  # of two pixels' surfaces: from others nothing is known
ANY_DIFFERENCE = 1e9  # with such a tolerance values stop nothing, not even where there is no noise
CENTRE = at_tap(0, 0)


def filter_by_variance(signal: Tensor, numerators: int, scale: float, tolerance: float, geometry: Tensor) -> Tensor:
    """`signal` (1, C, H, W) after all passes: `numerators` channels first, then their denominators (or the one).

    `scale`: what a value (numerator over denominator) of ordinary size is. `tolerance`: differences are measured in
    units of so many standard deviations. `geometry` (1, 7, H, W): guides over their sigmas, and 1 on surfaces.
    """
    import torch

    variance = by_sub_images(_variance, 1, _values(signal, numerators, scale), geometry)
    for step in STEPS:
        moments = torch.cat([_values(signal, numerators, scale), variance.double()], dim=1)
        # The values as measured are too noisy to guide the first pass: it looks at their mean over 3 x 3 pixels.
        radius = 1 if step == STEPS[0] else 0
        guides = by_sub_images(partial(_guide, tolerance, radius), 1, moments, geometry)
        both = by_sub_images(_pass, step, torch.cat([signal, variance], 1), torch.cat([guides, geometry], 1))
        signal, variance = both[:, :-1], both[:, -1:]
    return signal


def _values(signal: Tensor, numerators: int, scale: float) -> Tensor:
    """(1, 2, H, W) float64: luminance of the numerator, over `scale`, and of the denominator."""
    import torch

    over, under = (luminance(part.double()) for part in (signal[:, :numerators], signal[:, numerators:]))
    return torch.cat([over / scale, under], dim=1).clamp(min=0)


def _geometric(geometry: Tensor, radius: int) -> Iterator[tuple[tuple[slice, ...], int, int, Tensor]]:
    """Each tap of a square window with its place and its squared distance; infinite where background takes part.

    A pixel is at no distance from itself, wherever it lies.
    """
    import torch

    guides, surface = geometry[:, :6], geometry[:, 6:]
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            q = at_tap(dy, dx)
            apart = (guides[q] - guides[CENTRE]).square().sum(1, keepdim=True)
            if dy or dx:
                apart = torch.where(surface[CENTRE] * surface[q] > 0, apart, torch.inf)
            yield q, dy, dx, apart


def _likeness(apart: Tensor) -> Tensor:
    weight = (-0.5 * apart.double()).exp()
    return weight * (weight > LEAST_LIKENESS)


def _variance(values: Tensor, geometry: Tensor) -> Tensor:
    """How much single pixels' values scatter around their mean, over the like pixels of a 5 x 5 window: (n, 1, h, w).

    The mean is U-weighted (its sums are divided), so a pixel counts by what its samples could have lit.
    """
    import torch

    over, under = values[:, :1], values[:, 1:]
    total, s, u, ss, su, uu = (torch.zeros_like(over[CENTRE]) for _ in range(6))
    for q, _, _, apart in _geometric(geometry, 2):
        weight = _likeness(apart)
        a, b = over[q], under[q]
        total += weight
        s += weight * a
        u += weight * b
        ss += weight * a * a
        su += weight * a * b
        uu += weight * b * b
    mean = s / u
    scatter = (ss - 2 * mean * su + mean.square() * uu).clamp(min=0) * total
    variance = (scatter / u.square()).nan_to_num(nan=LARGEST**2).clamp(max=LARGEST**2)
    return torch.where(u > 0, variance, torch.zeros_like(variance)).float()


def _guide(tolerance: float, radius: int, moments: Tensor, geometry: Tensor) -> Tensor:
    """(n, 2, h, w): the mean value of like pixels `radius` around, and one over the deviation tolerated there."""
    import torch

    total = torch.zeros_like(moments[CENTRE][:, :1])
    sums = torch.zeros_like(moments[CENTRE])
    for q, _, _, apart in _geometric(geometry, radius):
        weight = _likeness(apart)
        total += weight
        sums += weight * moments[q]
    s, u, v = sums[:, :1], sums[:, 1:2], sums[:, 2:]
    known, nothing = u > 0, torch.zeros_like(u)
    value = torch.where(known, (s / u).clamp(max=LARGEST), nothing)
    if tolerance >= ANY_DIFFERENCE:
        return torch.cat([value, nothing], dim=1).float()
    deviation = tolerance * (v / total).sqrt() + LEAST_DEVIATION
    # Where no sample says anything around, any neighbour's word is welcome.
    return torch.cat([value, torch.where(known, 1 / deviation, nothing)], dim=1).float()


def _pass(signal: Tensor, guide: Tensor) -> Tensor:
    """One 5 x 5 pass over `signal` (n, C + 1, h, w), its last plane the variance, which shrinks as weights squared."""
    import torch

    value, per_deviation, geometry = torch.split(guide, [1, 1, guide.shape[1] - 2], dim=1)
    mixed, variance = signal[:, :-1], signal[:, -1:]
    change, total = torch.zeros_like(mixed[CENTRE]), torch.zeros_like(value[CENTRE])
    spread = torch.zeros_like(total)
    for q, dy, dx, apart in _geometric(geometry, 2):
        difference = (value[q] - value[CENTRE]).abs() * per_deviation[CENTRE]
        weight = GAUSSIAN[2 + dy] * GAUSSIAN[2 + dx] * (-0.5 * apart - difference).exp()
        if not (dy or dx):
            weight = torch.full_like(weight, GAUSSIAN[2] ** 2)
        change += weight * (mixed[q] - mixed[CENTRE])  # differences: a constant stays exact
        total += weight
        spread += weight.square() * variance[q]
    return torch.cat([mixed[CENTRE] + change / total, spread / total.square()], dim=1)
