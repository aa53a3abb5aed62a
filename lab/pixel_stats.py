"""What the values of a picture are like: range, mean, percentiles and a histogram."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.colour import luminance
from lab.errors import LabError

PERCENTILES = (1, 5, 25, 50, 75, 95, 99)


@dataclass(frozen=True)
class PixelStats:
    """Of the finite values among the pixels that were asked for; RGB counts by its luminance.

    Attributes:
        count: values that went in.    left_out: pixels asked for whose value is no finite number.
        minimum, maximum, mean: NaN where nothing went in.    percentiles: by percent, see :data:`PERCENTILES`.
        edges: (bins + 1,) borders of the histogram's bins.    counts: (bins,) values in each; the last holds its
            upper border too.
        below, above: values outside of the histogram's range.
    """

    count: int
    left_out: int
    minimum: float
    maximum: float
    mean: float
    percentiles: dict[int, float]
    edges: NDArray[np.float64]
    counts: NDArray[np.int64]
    below: int = 0
    above: int = 0

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it: what has no value is None."""
        numbers = {name: getattr(self, name) for name in ("minimum", "maximum", "mean")}
        return {
            "count": self.count,
            "left_out": self.left_out,
            **{name: value if np.isfinite(value) else None for name, value in numbers.items()},
            "percentiles": {str(percent): value for percent, value in self.percentiles.items()},
            "edges": self.edges.tolist(),
            "counts": self.counts.tolist(),
            "below": self.below,
            "above": self.above,
        }


def pixel_stats(
    values: ArrayLike,
    seen: NDArray[np.bool_] | None = None,
    *,
    bins: int = 48,
    low: float | None = None,
    high: float | None = None,
) -> PixelStats:
    """Statistics of (H, W) or (H, W, 3) `values` over the pixels `seen` (H, W), computed in float64.

    The histogram reaches from `low` to `high`, by default the least to the greatest value. Whole numbers get bins of
    whole width, each with its number in the middle, at most `bins` of them.
    """
    if bins < 1:
        raise LabError(f"bins={bins}: a histogram needs at least 1")
    pixels = np.asarray(values)
    whole = bool(np.issubdtype(pixels.dtype, np.integer))
    grey = np.asarray(luminance(pixels.astype(np.float64)) if pixels.ndim == 3 else pixels, np.float64)
    chosen = grey.ravel() if seen is None else grey[seen]
    known = chosen[np.isfinite(chosen)]
    left_out = int(chosen.size - known.size)
    if known.size == 0:
        nothing = np.zeros(bins, np.int64)
        return PixelStats(0, left_out, np.nan, np.nan, np.nan, {}, np.linspace(0, 1, bins + 1), nothing)
    least, greatest = float(known.min()), float(known.max())
    edges = _edges(least if low is None else low, greatest if high is None else high, bins, whole)
    counts, _ = np.histogram(known, edges)
    percentiles = {p: float(v) for p, v in zip(PERCENTILES, np.percentile(known, PERCENTILES), strict=True)}
    below, above = int((known < edges[0]).sum()), int((known > edges[-1]).sum())
    mean = float(known.mean())
    return PixelStats(
        known.size, left_out, least, greatest, mean, percentiles, edges, counts.astype(np.int64), below, above
    )


def _edges(low: float, high: float, bins: int, whole: bool) -> NDArray[np.float64]:
    if whole:
        first, last = np.floor(low), np.ceil(high)
        width = max(1.0, np.ceil((last - first + 1) / bins))
        return np.asarray(first - 0.5 + width * np.arange(np.ceil((last - first + 1) / width) + 1), np.float64)
    if high > low:
        return np.linspace(low, high, bins + 1)
    reach = max(abs(low), 1.0) / 2  # all values are one: a bin around it
    return np.linspace(low - reach, low + reach, bins + 1)
