"""Do draws follow their probabilities? Pearson's chi-square test, for outcomes of very unequal probability."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from lab.errors import LabError

LEAST_EXPECTED = 5.0
"""Draws that a bin must expect: the statistic has its distribution only where no bin is nearly empty (Cochran 1954)."""


class ChiSquare(NamedTuple):
    """The verdict on counts.

    Attributes:
        statistic: sum of (count - expected)^2 / expected over the bins; inf after a draw that is impossible.
        freedom: bins - 1.    p_value: chance of so great a statistic, or a greater one, if the probabilities are right.

    """

    statistic: float
    freedom: int
    p_value: float


def chi_square(counts: ArrayLike, probability: ArrayLike) -> ChiSquare:
    """Pearson's test of (n,) `counts` of independent draws against (n,) `probability` (in proportion to it).

    Outcomes that expect few draws are pooled, the rarest first, until every bin expects :data:`LEAST_EXPECTED`. With
    one bin there is nothing to compare: freedom 0 and a p-value of 1.
    """
    from scipy.special import chdtrc

    seen, weight = np.asarray(counts, np.float64), np.asarray(probability, np.float64)
    if seen.shape != weight.shape or seen.ndim != 1:
        raise LabError(f"chi_square: counts and probabilities must be of one length, got {seen.shape}, {weight.shape}")
    if not ((seen >= 0).all() and (weight >= 0).all()) or not np.isfinite(seen.sum() + weight.sum()):
        raise LabError("chi_square: counts and probabilities must be numbers, 0 or more")
    if (seen[weight == 0] > 0).any():
        return ChiSquare(float("inf"), 0, 0.0)
    possible = np.flatnonzero(weight)
    order = possible[np.argsort(weight[possible], kind="stable")]
    expected = weight[order] / max(float(weight.sum()), np.finfo(np.float64).tiny) * seen.sum()
    firsts, held = [0], 0.0
    for i, more in enumerate(expected):
        if held >= LEAST_EXPECTED:
            firsts.append(i)
            held = 0.0
        held += float(more)
    if len(firsts) > 1 and held < LEAST_EXPECTED:
        firsts.pop()
    if len(firsts) < 2:
        return ChiSquare(0.0, 0, 1.0)
    wanted = np.add.reduceat(expected, firsts)
    statistic = float(((np.add.reduceat(seen[order], firsts) - wanted) ** 2 / wanted).sum())
    return ChiSquare(statistic, len(firsts) - 1, float(chdtrc(len(firsts) - 1, statistic)))


def pooled(tests: Iterable[ChiSquare]) -> ChiSquare:
    """Many independent tests as one: statistics and freedoms add up."""
    from scipy.special import chdtrc

    found = list(tests)
    statistic, freedom = sum(test.statistic for test in found), sum(test.freedom for test in found)
    if np.isinf(statistic):
        return ChiSquare(statistic, freedom, 0.0)
    return ChiSquare(statistic, freedom, float(chdtrc(freedom, statistic)) if freedom else 1.0)
