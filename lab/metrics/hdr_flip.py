"""HDR-FLIP: how different two images look to a person who flips between them.

Sources: P. Andersson, J. Nilsson, T. Akenine-Moller et al., "FLIP: A Difference Evaluator for Alternating Images",
HPG 2020; P. Andersson et al., "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics 2021. Computed
by the authors' flip-evaluator. Its traps, and why its input is prepared here: where it can't find exposures (a black
or a very dark reference) it ends the whole process; its tone map overflows beyond 1e19 and shows such a firefly black;
a median of 0 makes its exposures, and with them the result, depend on the unit of the radiance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.colour import luminance
from lab.errors import LabError
from lab.metrics.error import pair

Array = NDArray[np.float64]

PIXELS_PER_DEGREE = 0.7 * (3840 / 0.7) * math.pi / 180
"""FLIP's own default, 67.02: a screen of 3840 pixels and 0.7 m, seen from 0.7 m."""

TONE_MAPPER = "aces"

MOST_STOPS = 32.0
"""Widest range of exposures. Only a reference of which single pixels outshine the rest by 2^32 has more."""

_BRIGHT = 2.0**40  # Far over white at every exposure, and its square still is a float32.


class Exposures(NamedTuple):
    """The exposures at which two images are compared: `steps` even steps from `start` to `stop`, in stops (log2)."""

    start: float
    stop: float
    steps: int


def flip(
    image: ArrayLike, reference: ArrayLike, *, pixels_per_degree: float = PIXELS_PER_DEGREE
) -> tuple[float, NDArray[np.float32]]:
    """Mean and (H, W) map of HDR-FLIP, from 0 (no visible difference) to 1.

    The map is, at each pixel, the greatest LDR-FLIP over :func:`flip_exposures`. Both images are (H, W, 3) linear
    RGB; what is below 0 counts as black, as no screen shows it. The exposures follow `reference`, so the two do not
    commute. Multiplying both by one factor changes nothing. Takes about 0.7 s an exposure at 1280x720 on two cores.

    Raises:
        LabError: for other shapes, for values that are not finite, and for `pixels_per_degree` not over 0.

    """
    from flip_evaluator import evaluate

    a, b = pair(image, reference)
    if a.ndim != 3 or a.shape[2] != 3:
        raise LabError(f"FLIP compares RGB images of shape (H, W, 3), got {a.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise LabError("FLIP needs finite images: there are NaN or infinite values in them")
    if not (math.isfinite(pixels_per_degree) and pixels_per_degree > 0):
        raise LabError(f"FLIP: pixels_per_degree={pixels_per_degree} must be over 0")
    a, b = np.maximum(a, 0.0), np.maximum(b, 0.0)
    exposures = flip_exposures(b) or flip_exposures(a)
    if exposures is None:
        return 0.0, np.zeros(a.shape[:2], np.float32)
    # Exposed in float64 here, so that radiance of any unit reaches the evaluator as values around 1.
    shown = [_exposed(x, exposures.stop) for x in (a, b)]
    settings = {
        "ppd": float(pixels_per_degree),
        "startExposure": exposures.start - exposures.stop,
        "stopExposure": 0.0,
        "numExposures": exposures.steps,
        "tonemapper": TONE_MAPPER,
    }
    errors, _, _ = evaluate(shown[1], shown[0], "HDR", applyMagma=False, computeMeanError=False, parameters=settings)
    error_map = np.asarray(errors, np.float32)[..., 0]
    return float(error_map.mean(dtype=np.float64)), error_map


def _exposed(image: Array, stops: float) -> NDArray[np.float32]:
    whole = math.floor(stops)
    with np.errstate(over="ignore"):
        exposed: Array = np.minimum(np.ldexp(image, whole) * 2.0 ** (stops - whole), _BRIGHT)
    return exposed.astype(np.float32)


def flip_exposures(reference: ArrayLike) -> Exposures | None:
    """The exposures that HDR-FLIP derives from an (H, W, 3) reference; None where it is black.

    From the one at which the brightest pixel is shown at 85 % of white to the one at which the median pixel is. Where
    more than half of the pixels are black, the median is that of the others.
    """
    seen = luminance(np.asarray(reference, np.float64)).ravel()
    lit = seen[seen > 0]
    if lit.size == 0:
        return None
    middle = np.partition(seen, seen.size // 2)[seen.size // 2]
    if middle <= 0:
        middle = np.partition(lit, lit.size // 2)[lit.size // 2]
    stop = math.log2(_NEAR_WHITE) - math.log2(middle)
    start = max(math.log2(_NEAR_WHITE) - math.log2(lit.max()), stop - MOST_STOPS)
    return Exposures(start, stop, max(2, math.ceil(stop - start)))


def _exposed_to(level: float) -> float:
    """The radiance that the ACES curve x (a x + b) / (x (c x + d) + e) shows at `level`."""
    # K. Narkowicz's fit, with the 0.6 of its usual exposure taken in.
    a, b, c, d, e = 0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14
    p, q = a - level * c, b - level * d
    return (-q + math.sqrt(q * q + 4 * p * level * e)) / (2 * p)


_NEAR_WHITE = _exposed_to(0.85)
