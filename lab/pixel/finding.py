"""The pixel that shows a point of the scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from lab.records import GBuffer

_FOOTPRINTS = 4.0
"""A surface seen at a grazing angle has its pixels' points this many footprints apart."""


def pixel_of_point(gbuffer: GBuffer, point: ArrayLike) -> tuple[int, int] | None:
    """The pixel (x, y) whose surface point is nearest to `point` (3,); None where the camera does not see it.

    "Sees it" means that the nearest pixel's point lies within a few of its footprints, ``depth * pixel_angle``.
    """
    away = np.linalg.norm(gbuffer.position - np.asarray(point, np.float32), axis=-1)
    away[gbuffer.depth <= 0] = np.inf
    y, x = np.unravel_index(int(np.argmin(away)), away.shape)
    reach = _FOOTPRINTS * float(gbuffer.depth[y, x]) * gbuffer.pixel_angle
    return (int(x), int(y)) if float(away[y, x]) <= reach else None
