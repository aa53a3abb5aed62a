"""How many lights the pixels of a frame look at: level by level and in total, as numbers, histograms and maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError, nearest
from lab.records import Frame

COUNTED = ("overdraw", "lights_used")
"""The counts of :class:`lab.records.Lighting`."""

_MOST_BINS = 40


@dataclass(frozen=True)
class CountStatistics:
    """Counts of one level, or of all together, over the pixels that see a surface.

    Attributes:
        level: None for the total.
        map: (H, W) uint32 counts.
        pixels: how many see a surface; without any, the numbers are 0 and the histogram is empty.
        mean, median, p95: of these pixels; p95 is the value that 95 % of them stay under, between neighbours linear.
        max: the greatest.
        edges: (b + 1,) whole numbers; bin i holds the counts from ``edges[i]`` to ``edges[i + 1] - 1``.
        histogram: (b,) pixels in each bin.
    """

    level: int | None
    map: NDArray[np.uint32]
    pixels: int
    mean: float
    median: float
    p95: float
    max: int
    edges: NDArray[np.int64]
    histogram: NDArray[np.int64]


@dataclass(frozen=True)
class OverdrawSurvey:
    """Statistics of a frame's counts.

    Attributes:
        counted: ``overdraw``, lights whose reach contains the pixel, or ``lights_used``, those that light it.
        total: of all levels together.
        levels: of each level, finest first; ``levels[l].level == l``. Level 0 is not drawn with ``first_level=1``.
        seen: (H, W) pixels that see a surface.
    """

    counted: str
    total: CountStatistics
    levels: list[CountStatistics]
    seen: NDArray[np.bool_]


def overdraw_survey(frame: Frame, counted: str = "overdraw") -> OverdrawSurvey:
    """Statistics of the lights that each pixel looks at.

    `counted`: one of :data:`COUNTED`. Errors: :class:`LabError` for another word, and where the frame was rendered
    without its counts.
    """
    if counted not in COUNTED:
        raise LabError(f"counted={counted}: there are {' and '.join(COUNTED)}{nearest(counted, COUNTED)}")
    overdraw, lights_used = frame.lighting.counts()
    maps = overdraw if counted == "overdraw" else lights_used
    seen: NDArray[np.bool_] = frame.gbuffer.depth > 0
    total = _statistics(None, maps.sum(axis=0, dtype=np.uint32), seen)
    return OverdrawSurvey(counted, total, [_statistics(i, level, seen) for i, level in enumerate(maps)], seen)


def _statistics(level: int | None, counts: NDArray[np.uint32], seen: NDArray[np.bool_]) -> CountStatistics:
    values = counts[seen]
    if values.size == 0:
        return CountStatistics(level, counts, 0, 0.0, 0.0, 0.0, 0, np.arange(2), np.zeros(1, np.int64))
    median, p95 = np.quantile(values, [0.5, 0.95])
    most = int(values.max())
    edges = _edges(most)
    histogram = np.bincount(values // int(edges[1]), minlength=len(edges) - 1)
    mean = float(values.mean(dtype=np.float64))
    return CountStatistics(level, counts, values.size, mean, float(median), float(p95), most, edges, histogram)


def _edges(most: int) -> NDArray[np.int64]:
    """Edges of even bins from 0 to beyond `most`, at most :data:`_MOST_BINS`, as wide as 1, 2, 5, 10, 20 ..."""
    width, digit = 1, 0
    while most // width + 1 > _MOST_BINS:
        width = width * 5 // 2 if digit == 1 else width * 2
        digit = (digit + 1) % 3
    return np.arange(most // width + 2, dtype=np.int64) * width
