"""LY19 Figure 5: mean overdraw against the logarithm of the number of grid lights, as the VPL count grows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.engine.engine import Engine
from lab.errors import LabError
from lab.params import Params
from lab.records import GBuffer
from lab.reference.estimate import Progress

COUNTS = (1_000, 10_000, 100_000, 1_000_000)
"""The paper's VPL counts."""


@dataclass(frozen=True)
class OverdrawGrowth:
    """One entry a VPL count, and the line through them: mean overdraw = intercept + slope * ln(grid lights).

    Attributes:
        vpls: as asked for.    grid_lights: of all drawn levels together.
        overdraw: mean over the pixels that see a surface.
        r_squared: share of the overdraw's variance that the line explains.
    """

    vpls: list[int]
    grid_lights: list[int]
    overdraw: list[float]
    slope: float
    intercept: float
    r_squared: float

    def fitted(self, grid_lights: ArrayLike) -> NDArray[np.float64]:
        """The line at these numbers of grid lights."""
        line: NDArray[np.float64] = self.intercept + self.slope * np.log(np.asarray(grid_lights, np.float64))
        return line


def overdraw_growth(
    engine: Engine,
    gbuffer: GBuffer,
    counts: Sequence[int] = COUNTS,
    params: Params | None = None,
    progress: Progress | None = None,
) -> OverdrawGrowth:
    """Measures and fits the growth of overdraw on the pixels of a G-buffer.

    Args:
        engine: of the scene.
        gbuffer: of the view.
        counts: numbers of VPLs, two or more that differ.
        params: the other settings; default: the paper's, where the lights themselves are not drawn.
        progress: called with the share that is done and a line; may raise to end it.

    Errors: :class:`LabError` for fewer counts, for a view of nothing, and for a scene lit by a list of lights, whose
    number is not ours to choose.
    """
    if len(set(counts)) < 2:
        raise LabError(f"counts={list(counts)}: two or more different numbers of VPLs are needed to fit a line")
    if engine.scene.light_list is not None:
        raise LabError(
            f"{engine.scene.name} is lit by a list of lights: how overdraw grows with VPLs can't be measured"
        )
    seen = gbuffer.depth > 0
    if not seen.any():
        raise LabError(f"{engine.scene.name}: the view sees no surface, so it has no overdraw; choose another camera")
    base = (params or Params(first_level=1)).replace(shadow_samples=0)
    # An engine's time for one count is about proportional to its logarithm here, but the largest takes most of it.
    length = np.sqrt(np.asarray(counts, np.float64))
    grid_lights, overdraw = [], []
    for i, vpls in enumerate(counts):
        if progress:
            progress(float(length[:i].sum() / length.sum()), f"{vpls:,} VPLs")
        settings = base.replace(vpls=vpls)
        hierarchy = engine.build_hierarchy(engine.trace_vpls(settings), settings)
        lighting = engine.light(hierarchy, gbuffer, settings)
        grid_lights.append(int(hierarchy.offset[-1] - hierarchy.offset[settings.first_level]))
        overdraw.append(float(lighting.counts()[0].sum(axis=0)[seen].mean(dtype=np.float64)))
    if progress:
        progress(1.0, "done")
    x, y = np.log(grid_lights), np.array(overdraw)
    slope, intercept = np.polyfit(x, y, 1)
    spread = float(np.sum((y - y.mean()) ** 2))
    missed = float(np.sum((y - intercept - slope * x) ** 2))
    r_squared = 1 - missed / spread if spread > 0 else 1.0
    return OverdrawGrowth(list(counts), grid_lights, overdraw, float(slope), float(intercept), r_squared)
