"""How far an image is from a reference, in one number or as a map.

All functions take arrays of any equal shape, for example (H, W, 3) or (n, 3), and compute in float64. A value that is
no number in either image makes the result NaN.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError

Array = NDArray[np.float64]

FLOOR = 0.01
"""Share of the reference's mean that relative errors are floored with."""

_TINY = float(np.finfo(np.float64).tiny)


def pair(image: ArrayLike, reference: ArrayLike) -> tuple[Array, Array]:
    """Both as float64; a :class:`LabError` unless they have one shape and something in it."""
    a, b = np.asarray(image, np.float64), np.asarray(reference, np.float64)
    if a.shape != b.shape or a.size == 0:
        raise LabError(
            f"an image and its reference must have the same shape and pixels in it, got {a.shape} and {b.shape}"
        )
    return a, b


def floor_of(reference: ArrayLike) -> float:
    """The epsilon e of relative errors: 1 % of the reference's mean (its magnitude).

    It keeps dark pixels, where any error is relatively great, from ruling the mean.
    """
    return float(FLOOR * abs(np.mean(np.asarray(reference, np.float64))))


def _scale2(reference: Array, epsilon: float | None) -> Array:
    """b^2 + e^2, never 0."""
    e = floor_of(reference) if epsilon is None else epsilon
    scale: Array = reference**2 + max(e**2, _TINY)
    return scale


def mse(image: ArrayLike, reference: ArrayLike) -> float:
    """Mean squared error, mean of (a - b)^2."""
    a, b = pair(image, reference)
    return float(np.mean((a - b) ** 2))


def rmse(image: ArrayLike, reference: ArrayLike) -> float:
    """Square root of :func:`mse`, in the unit of the images."""
    return float(np.sqrt(mse(image, reference)))


def rel_mse(image: ArrayLike, reference: ArrayLike, *, epsilon: float | None = None) -> float:
    """Relative mean squared error, mean of (a - b)^2 / (b^2 + e^2) with e = 1 % of the reference's mean.

    Another `epsilon` may be given: with the whole image's, the values of its parts average to the value of the whole.
    Against a black reference every other image is beyond measure: the result is huge or infinite.
    """
    a, b = pair(image, reference)
    with np.errstate(over="ignore"):
        return float(np.mean((a - b) ** 2 / _scale2(b, epsilon)))


def rel_mse_noise(reference: ArrayLike, variance: ArrayLike, *, epsilon: float | None = None) -> float:
    """The part of :func:`rel_mse` that a noisy reference brings by itself, mean of v / (b^2 + e^2).

    `variance` is that of the reference's pixels (the variance of their mean, not of one sample). An image without any
    error would have this relMSE, to first order in the noise.
    """
    b, v = pair(reference, variance)
    with np.errstate(over="ignore"):
        return float(np.mean(v / _scale2(b, epsilon)))


def relative_error(image: ArrayLike, reference: ArrayLike, *, epsilon: float | None = None) -> Array:
    """Signed relative error of each value, (a - b) / sqrt(b^2 + e^2); the mean of its square is :func:`rel_mse`."""
    a, b = pair(image, reference)
    with np.errstate(over="ignore"):
        error: Array = (a - b) / np.sqrt(_scale2(b, epsilon))
    return error


def energy_ratio(image: ArrayLike, reference: ArrayLike) -> float:
    """Sum of `image` over sum of `reference`; 1 where no light is lost or invented."""
    a, b = pair(image, reference)
    return float(a.sum() / max(b.sum(), _TINY))
