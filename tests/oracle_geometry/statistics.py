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


def welch_test(first: ArrayLike, second: ArrayLike, rounding: ArrayLike = 0.0) -> Array:
    """p-values of (n, ...) and (m, ...) independent samples having one mean, whatever their variances (Welch 1947).

    One row alone is exact: Student's t-test against it. Means are known to `rounding`.
    """
    a, b = np.asarray(first, np.float64), np.asarray(second, np.float64)
    gap = np.maximum(0.0, np.abs(a.mean(axis=0) - b.mean(axis=0)) - rounding)
    parts = [(x.var(axis=0, ddof=1) / len(x), len(x) - 1) if len(x) > 1 else (np.zeros(x.shape[1:]), 1) for x in (a, b)]
    square = sum(variance for variance, _ in parts)
    freedom = square**2 / np.maximum(sum(v**2 / f for v, f in parts), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(gap > 0, gap / np.sqrt(square), 0.0)  # inf where nothing varies and the means differ
    return np.asarray(2 * stats.t.sf(t, np.maximum(freedom, 1)), np.float64)


def block_means(images: ArrayLike, size: int) -> Array:
    """(n, H, W) images as (n, H / size, W / size) means of blocks: near to normal where single pixels are not."""
    pixels = np.asarray(images, np.float64)
    n, height, width = pixels.shape
    return pixels.reshape(n, height // size, size, width // size, size).mean(axis=(2, 4))


def accept(p_values: ArrayLike) -> bool:
    """Whether the smallest of a family of independent p-values passes (Sidak's correction)."""
    p = np.ravel(np.asarray(p_values, np.float64))
    return bool(p.min() > 1 - (1 - SIGNIFICANCE) ** (1 / p.size))
