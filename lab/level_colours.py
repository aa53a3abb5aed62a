"""One colour a level, the same in every picture and plot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEVEL_COLOURS = (
    "#4c7dd9", "#54c4ff", "#0091a0", "#00d4bc", "#069954", "#9dc957", "#928100",
    "#f1a633", "#c65e23", "#ff9497", "#c1558a", "#e794ec", "#8c69cd",
)  # fmt: skip
"""Levels 0 to 12: the hue goes from blue through green and orange to violet, so that the order shows; the lightness
alternates, so that neighbours can be told apart (OKLab: L 0.60 and 0.78, 27 degrees of hue a level)."""


def rgb(colour: str) -> tuple[int, int, int]:
    """``#rrggbb`` as three bytes."""
    r, g, b = bytes.fromhex(colour.removeprefix("#"))
    return r, g, b


def category_colours(kind: str) -> tuple[str, ...]:
    """The colours of the categories 0, 1, 2 ... of a kind, ``level`` or ``tile``; they repeat after the last."""
    count = len(LEVEL_COLOURS)
    # Tiles that are neighbours should differ much: five levels apart.
    return LEVEL_COLOURS if kind == "level" else tuple(LEVEL_COLOURS[i * 5 % count] for i in range(count))


def category_table(kind: str) -> NDArray[np.uint8]:
    """(13, 3) these colours as bytes."""
    return np.array([rgb(colour) for colour in category_colours(kind)], np.uint8)
