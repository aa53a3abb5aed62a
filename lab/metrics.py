"""How far an image is from a reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError


def _pair(image: ArrayLike, reference: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b = np.asarray(image, np.float64), np.asarray(reference, np.float64)
    if a.shape != b.shape or a.size == 0:
        raise LabError(
            f"an image and its reference must have the same shape and pixels in it, got {a.shape} and {b.shape}"
        )
    return a, b


def rel_mse(image: ArrayLike, reference: ArrayLike) -> float:
    """Relative mean squared error, mean of (a - b)^2 / (b^2 + e^2) with e = 1 % of the reference's mean.

    `image` and `reference` have any equal shape, for example (H, W, 3) or (n, 3).
    """
    a, b = _pair(image, reference)
    floor = 0.01 * b.mean()
    return float(np.mean((a - b) ** 2 / (b**2 + max(floor**2, np.finfo(np.float64).tiny))))


def energy_ratio(image: ArrayLike, reference: ArrayLike) -> float:
    """Sum of `image` over sum of `reference`; 1 where no light is lost or invented."""
    a, b = _pair(image, reference)
    return float(a.sum() / max(b.sum(), np.finfo(np.float64).tiny))
