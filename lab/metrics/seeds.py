"""Errors over many renderings of one picture: what is noise, what is bias, what flickers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError
from lab.metrics.error import floor_of, pair, rel_mse_noise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Moments:
    """Mean and variance of N renderings, pixel by pixel.

    Attributes:
        count: N, or an array of counts of the images' shape.
        mean: (...) mean.    variance: (...) unbiased variance of one rendering, sum of squares over N - 1.

    """

    count: ArrayLike
    mean: Array
    variance: Array


@dataclass(frozen=True)
class BiasVariance:
    """The error of a method, split: what stays when the noise is averaged away, and the noise of one rendering.

    Attributes:
        bias2: (...) unbiased estimate of the squared bias; below 0 where the noise happens to outweigh it.
        variance: (...) variance of one rendering.
        rel_bias2, rel_variance: means of both over b^2 + e^2, as in :func:`lab.metrics.rel_mse`.

    """

    bias2: Array
    variance: Array
    rel_bias2: float
    rel_variance: float


def moments(images: Iterable[ArrayLike]) -> Moments:
    """Mean and variance of two or more images of one shape, taken one at a time (Welford's recurrence)."""
    count = 0
    mean: Array = np.zeros(0)
    squares: Array = np.zeros(0)
    for image in images:
        values = np.asarray(image, np.float64)
        if count == 0:
            mean, squares = np.zeros_like(values), np.zeros_like(values)
        values, _ = pair(values, mean)
        count += 1
        step = values - mean
        mean = mean + step / count
        squares = squares + step * (values - mean)
    if count < 2:
        raise LabError(f"two or more renderings are needed to tell noise from bias, got {count}")
    return Moments(count, mean, squares / (count - 1))


def bias_variance(
    images: Iterable[ArrayLike], reference: ArrayLike, *, reference_variance: ArrayLike = 0.0
) -> BiasVariance:
    """Squared bias and variance apart, from N renderings with independent seeds.

    With mean m and unbiased variance s^2 over the seeds: bias^2 = (m - b)^2 - s^2 / N - v, where v is the
    `reference_variance` of a noisy reference's pixels (of its mean). Without v, ``rel_bias2 + rel_variance`` is
    exactly the mean relMSE of the renderings.
    """
    seen = moments(images)
    mean, b = pair(seen.mean, reference)
    noise = np.broadcast_to(np.asarray(reference_variance, np.float64), b.shape)
    bias2 = (mean - b) ** 2 - seen.variance / np.asarray(seen.count) - noise
    return BiasVariance(bias2, seen.variance, rel_mse_noise(b, bias2), rel_mse_noise(b, seen.variance))


def temporal(images: Iterable[ArrayLike]) -> tuple[float, Array]:
    """How much a still picture flickers: the mean over its pixels, and the map, of std / mean over the frames.

    Per value, s / sqrt(m^2 + e^2) with e = 1 % of the overall mean, s^2 unbiased over the frames. `images` are two
    or more frames of one shape, of a camera and scene that stand still.
    """
    seen = moments(images)
    scale = np.sqrt(seen.mean**2 + max(floor_of(seen.mean) ** 2, np.finfo(np.float64).tiny))
    flicker: Array = np.sqrt(seen.variance) / scale
    return float(flicker.mean()), flicker
