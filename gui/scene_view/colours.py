"""Colours of the 3D view, chosen for its dark background."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lab.colour import HEAT
from lab.level_colours import LEVEL_COLOURS, rgb

Rgb = tuple[int, int, int]
Bytes = NDArray[np.uint8]

BACKGROUND: Rgb = (22, 23, 27)
TEXT: Rgb = (226, 225, 220)
QUIET: Rgb = (150, 150, 156)

FREE: Rgb = (88, 214, 120)
BLOCKED: Rgb = (240, 84, 72)
SELECTED: Rgb = (255, 255, 255)
MEMBER: Rgb = (236, 112, 214)
LOBE: Rgb = (250, 208, 84)
NORMAL: Rgb = (255, 140, 60)
DEVIATION: Rgb = (72, 200, 200)
CAMERA: Rgb = (170, 190, 235)
SHELLS: dict[str, Rgb] = {"r/2": (96, 150, 250), "r": (230, 230, 235), "2r": (232, 150, 96)}

LEVELS: tuple[Rgb, ...] = tuple(rgb(colour) for colour in LEVEL_COLOURS)
"""One a level, the finest first; as in pictures and plots."""

RAMP: Bytes = HEAT[80:]
"""(n, 3): the heatmaps' colours without the darkest, which the background would swallow."""


def ramp_colours(place: NDArray[np.floating]) -> Bytes:
    """(n,) places from 0 to 1 along :data:`RAMP` as (n, 3) colours; what lies beyond takes the end's."""
    rows = np.clip(np.rint(place * (len(RAMP) - 1)), 0, len(RAMP) - 1).astype(np.intp)
    return np.asarray(RAMP[rows])


def hues(flux: NDArray[np.floating], bright: NDArray[np.floating]) -> Bytes:
    """(n, 3) flux as colours of its hue, whose strongest channel goes with `bright` (n,), 0 to 1, from dim to full.

    Dim is still seen on the dark background.
    """
    peak = flux.max(axis=1, keepdims=True)
    hue = np.where(peak > 0, flux / np.where(peak > 0, peak, 1), 1) ** (1 / 2.2)
    return np.asarray(np.rint(255 * hue * (0.35 + 0.65 * np.clip(bright, 0, 1))[:, None]), np.uint8)
