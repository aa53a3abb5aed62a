"""Hypothesis tests with a fixed chance of a false alarm over a whole family of comparisons (Sidak)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

Array = NDArray[np.float64]

SIGNIFICANCE = 1e-3
"""Chance that a family of tests of a correct sampler fails (for the fixed seeds: once, when it is written)."""


def chi_square(counts: ArrayLike, probability: ArrayLike) -> float:
    """p-value of (n,) `counts` drawn with (n,) `probability`; bins that expect under 5 draws are pooled.

    A draw of an impossible outcome is a p-value of 0.
    """
    counts, probability = np.asarray(counts, np.float64), np.asarray(probability, np.float64)
    probability = probability / probability.sum()
    if (counts[probability == 0] > 0).any():
        return 0.0
    expected = probability * counts.sum()
    order = np.argsort(expected)
    bins: list[list[float]] = [[0.0, 0.0]]
    for i in order[expected[order] > 0]:
        if bins[-1][1] >= 5:
            bins.append([0.0, 0.0])
        bins[-1][0] += counts[i]
        bins[-1][1] += expected[i]
    if len(bins) > 1 and bins[-1][1] < 5:
        last = bins.pop()
        bins[-1] = [bins[-1][0] + last[0], bins[-1][1] + last[1]]
    if len(bins) == 1:
        return 1.0
    seen, wanted = np.array(bins).T
    return float(stats.chi2.sf(((seen - wanted) ** 2 / wanted).sum(), len(bins) - 1))


def same_distribution(first: ArrayLike, second: ArrayLike) -> float:
    """p-value of two (n,) count vectors having one distribution."""
    table = np.array([first, second], np.float64)
    table = table[:, table.sum(axis=0) > 0]
    small = table.sum(axis=0) < 20
    if small.any():
        table = np.concatenate([table[:, ~small], table[:, small].sum(axis=1, keepdims=True)], axis=1)
    return float(stats.chi2_contingency(table).pvalue)


def z_test(samples: ArrayLike, mean: ArrayLike, rounding: float = 0.0) -> Array:
    """p-values of the means of (n, m) independent `samples` being (m,) `mean`, known to `rounding`."""
    samples = np.asarray(samples, np.float64)
    error = samples.std(axis=0, ddof=1) / np.sqrt(len(samples))
    gap = np.abs(samples.mean(axis=0) - np.asarray(mean, np.float64))
    z = np.maximum(0.0, gap - rounding) / np.maximum(error, 1e-12)
    return np.asarray(2 * stats.norm.sf(z), np.float64)


def accept(p_values: ArrayLike) -> bool:
    """Whether the smallest of a family of independent p-values passes (Sidak's correction)."""
    p = np.atleast_1d(np.asarray(p_values, np.float64))
    return bool(p.min() > 1 - (1 - SIGNIFICANCE) ** (1 / p.size))
