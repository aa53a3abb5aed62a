"""Is the difference of two images more than noise? p-values of every pixel, and one verdict over all of them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError
from lab.metrics.error import pair
from lab.metrics.seeds import Moments, moments

Array = NDArray[np.float64]

SIGNIFICANCE = 0.01
"""Chance that a correct renderer is refused, over the whole family of pixels."""


class Sidak(NamedTuple):
    """The verdict over a family of tests.

    Attributes:
        failing: tests whose p-value is below `threshold`.    accepted: there is none.
        threshold: significance of a single test.    tests: how many there are.

    """

    failing: int
    accepted: bool
    threshold: float
    tests: int


def z_test(
    image: ArrayLike, reference: ArrayLike, variance_of_difference: ArrayLike, *, tolerance: ArrayLike = 0.0
) -> Array:
    """Two-sided p-values of the hypothesis that both have the same expectation, for a known variance.

    p = erfc(|a - b| / sqrt(2 v)): the difference of each value is taken as Gaussian. That holds for averages of many
    samples; rare bright samples need more of them, or the means of blocks of pixels. The tests of one pixel's three
    channels are not independent.

    Args:
        image: (...) means of samples.
        reference: (...) of the same shape.
        variance_of_difference: (...) or a number: the sum of the variances of both means. Where it is 0, equal values
            have p = 1 and all others 0.
        tolerance: (...) or a number: difference that is known and allowed, such as rounding; it is taken off |a - b|.

    """
    from scipy.special import erfc

    a, b = pair(image, reference)
    variance = _variance(variance_of_difference, a.shape)
    gap = np.maximum(np.abs(a - b) - np.asarray(tolerance, np.float64), 0.0)
    p: Array = np.where(gap > 0, 0.0, 1.0)
    np.divide(gap, np.sqrt(2 * variance), out=gap, where=variance > 0)
    return np.where(variance > 0, erfc(gap), p)


def welch_test(samples_a: Iterable[ArrayLike] | Moments, samples_b: Iterable[ArrayLike] | Moments) -> Array:
    """Two-sided p-values of equal expectations, from two sets of independent renderings (Welch 1947).

    t = (m_a - m_b) / sqrt(s_a^2 / n_a + s_b^2 / n_b) against Student's distribution with the degrees of freedom of
    Welch and Satterthwaite: neither the variances nor the numbers of seeds need be equal. Each set is (N, ...) images,
    N >= 2, or their :class:`Moments`. Where both variances are 0, equal means have p = 1 and all others 0.
    """
    from scipy.special import stdtr

    a, b = (s if isinstance(s, Moments) else moments(s) for s in (samples_a, samples_b))
    mean_a, mean_b = pair(a.mean, b.mean)
    counts = [np.broadcast_to(np.asarray(s.count, np.float64), mean_a.shape) for s in (a, b)]
    if any((count < 2).any() for count in counts):
        raise LabError("Welch's test needs two or more renderings of each pixel")
    shares = [_variance(s.variance, mean_a.shape) / n for s, n in zip((a, b), counts, strict=True)]
    error2 = shares[0] + shares[1]
    known = error2 > 0
    # As shares of the whole: their own squares could vanish.
    parts = [np.divide(share, error2, out=np.ones_like(error2), where=known) for share in shares]
    freedom = 1 / (parts[0] ** 2 / (counts[0] - 1) + parts[1] ** 2 / (counts[1] - 1))
    t = np.divide(np.abs(mean_a - mean_b), np.sqrt(error2), out=np.zeros_like(error2), where=known)
    return np.where(known, 2 * stdtr(freedom, -t), np.where(mean_a == mean_b, 1.0, 0.0))


def sidak(p_values: ArrayLike, significance: float = SIGNIFICANCE) -> Sidak:
    """How many of a family of tests fail, if all of them together may err with the chance `significance`.

    One of n independent tests fails below 1 - (1 - significance)^(1/n) (Sidak 1967). Tests that go together, such as
    neighbouring pixels behind a filter, make the verdict only more lenient.
    """
    p = np.asarray(p_values, np.float64)
    if not 0 < significance < 1:
        raise LabError(f"significance={significance} must lie between 0 and 1")
    if p.size == 0 or not ((p >= 0) & (p <= 1)).all():
        wrong = int(p.size - ((p >= 0) & (p <= 1)).sum())
        raise LabError(f"p-values must lie from 0 to 1, and there must be some; {wrong} of {p.size} do not")
    threshold = float(-np.expm1(np.log1p(-significance) / p.size))
    failing = int((p < threshold).sum())
    return Sidak(failing, failing == 0, threshold, p.size)


def _variance(variance: ArrayLike, shape: tuple[int, ...]) -> Array:
    values = np.broadcast_to(np.asarray(variance, np.float64), shape)
    if not (values >= 0).all():
        raise LabError("a variance must be 0 or more and a number; there are others among those given")
    return values
