"""The overdraw picture: totals and one panel a level, each with a title, and colour bars with values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lab.colour import HEAT, heat
from lab.figure import (
    BAR,
    GAP,
    LABEL,
    LINE,
    MARGIN,
    PAPER,
    TALLEST,
    WIDTH,
    Box,
    draw_bar,
    draw_panel,
    draw_title,
    fit,
    fitting_font,
    nice_ticks,
)

_UNSEEN = (205, 204, 200)


@dataclass(frozen=True)
class Panel:
    """One map of counts: its title and (H, W) values."""

    title: str
    counts: NDArray[np.uint32]


def draw_heatmap(totals: Sequence[Panel], levels: Sequence[Panel], seen: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """The picture, (h, w, 3) sRGB bytes. Pixels not `seen` (H, W) are grey.

    The totals share a scale, and so do all levels, so that they can be compared by eye. Scales run from 0 to the
    greatest count.
    """
    height, width = seen.shape
    large = fit(width, height, WIDTH, TALLEST)
    columns = min(3 if len(levels) <= 6 else 4, len(levels))
    small = fit(width, height, (WIDTH - GAP * (columns - 1)) // columns, TALLEST // 2)
    rows = math.ceil(len(levels) / columns)
    grid_height = rows * (small[1] + LINE + GAP) - GAP

    top = MARGIN
    second = top + len(totals) * (LINE + large[1] + 2 * GAP)
    page = (2 * MARGIN + WIDTH + GAP + BAR + LABEL, second + grid_height + MARGIN)
    canvas = Image.new("RGB", page, PAPER)

    scale = _greatest(totals, seen)
    bar_x = MARGIN + WIDTH + GAP
    for total in totals:
        draw_panel(canvas, _coloured(total, seen, scale), (MARGIN, top), large)
        draw_title(canvas, total.title, fitting_font([total.title], WIDTH), (MARGIN, top))
        _draw_bar(canvas, (bar_x, top + LINE, BAR, large[1]), scale)
        top += LINE + large[1] + 2 * GAP

    scale = _greatest(levels, seen)
    font = fitting_font([panel.title for panel in levels], small[0])
    for i, panel in enumerate(levels):
        column, row = i % columns, i // columns
        corner = MARGIN + column * (small[0] + GAP), second + row * (small[1] + LINE + GAP)
        draw_panel(canvas, _coloured(panel, seen, scale), corner, small)
        draw_title(canvas, panel.title, font, corner)
    _draw_bar(canvas, (bar_x, second + LINE, BAR, grid_height - LINE), scale)
    return np.asarray(canvas)


def _greatest(panels: Sequence[Panel], seen: NDArray[np.bool_]) -> float:
    return max([1.0, *(float(panel.counts[seen].max()) for panel in panels if seen.any())])


def _coloured(panel: Panel, seen: NDArray[np.bool_], scale: float) -> NDArray[np.uint8]:
    return np.where(seen[..., None], heat(panel.counts, scale), np.asarray(_UNSEEN, dtype=np.uint8))


def _draw_bar(canvas: Image.Image, box: Box, scale: float) -> None:
    ticks = nice_ticks(scale, max(3, box[3] // 60))
    draw_bar(canvas, box, HEAT, [(value / scale, f"{value:,.10g}") for value in ticks])
