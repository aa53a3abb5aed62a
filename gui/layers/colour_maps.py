"""Colour maps by name, as (n, 3) tables of bytes."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from lab.colour import HEAT
from lab.error_picture import MAGMA, SIGNED
from lab.errors import LabError, nearest

Pixels = NDArray[np.uint8]

COLOUR_MAPS = ("heat", "grey", "magma", "viridis", "signed")
"""Lowest value first: heat and magma dark to bright; viridis blue to yellow; grey black to white; signed blue, white,
red."""

UNKNOWN = (150, 152, 158), (136, 138, 144)
"""Two neutral greys in stripes, for pixels without a value: no colour map has stripes."""


@cache
def table(name: str) -> Pixels:
    """(256, 3) colours, lowest value first."""
    if name == "viridis":
        from matplotlib import colormaps

        shares = np.asarray(colormaps["viridis"](np.arange(256)), np.float64)[:, :3]
        return np.asarray(np.rint(shares * 255), np.uint8)
    tables = {"heat": HEAT, "magma": MAGMA, "signed": SIGNED, "grey": np.repeat(np.arange(256)[:, None], 3, axis=1)}
    if name not in tables:
        raise LabError(f"colour map {name!r}: there are {', '.join(COLOUR_MAPS)}{nearest(name, COLOUR_MAPS)}")
    return np.asarray(tables[name], np.uint8)


@cache
def stripes(height: int, width: int) -> Pixels:
    """(H, W, 3) what stands where there is no value."""
    y, x = np.mgrid[:height, :width]
    return np.asarray(np.array(UNKNOWN, np.uint8)[((x + y) // 3) % 2])
