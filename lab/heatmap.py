"""The overdraw picture: the total and one panel a level, each with a title, and colour bars with values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from lab.colour import HEAT, heat

WIDTH, TALLEST = 960, 720
"""Largest panel, in pixels of the picture."""

_MARGIN, _GAP, _BAR, _LABEL, _LINE = 24, 14, 18, 64, 26
_PAPER, _INK, _UNSEEN = (250, 249, 246), (32, 32, 36), (205, 204, 200)


@dataclass(frozen=True)
class Panel:
    """One map of counts: its title and (H, W) values."""

    title: str
    counts: NDArray[np.uint32]


def draw_heatmap(total: Panel, levels: Sequence[Panel], seen: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """The picture, (h, w, 3) sRGB bytes. Pixels not `seen` (H, W) are grey.

    The total has its own scale; all levels share one, so that they can be compared by eye. Scales run from 0 to the
    greatest count.
    """
    height, width = seen.shape
    large = _fit(width, height, WIDTH, TALLEST)
    columns = min(3 if len(levels) <= 6 else 4, len(levels))
    small = _fit(width, height, (WIDTH - _GAP * (columns - 1)) // columns, TALLEST // 2)
    rows = math.ceil(len(levels) / columns)
    grid_height = rows * (small[1] + _LINE + _GAP) - _GAP

    top = _MARGIN
    second = top + _LINE + large[1] + 2 * _GAP
    page = (2 * _MARGIN + WIDTH + _GAP + _BAR + _LABEL, second + grid_height + _MARGIN)
    canvas = Image.new("RGB", page, _PAPER)

    scale = _greatest([total], seen)
    _draw_panel(canvas, _coloured(total, seen, scale), (_MARGIN, top), large)
    _draw_title(canvas, total.title, _fitting_font([total], WIDTH), (_MARGIN, top))
    bar_x = _MARGIN + WIDTH + _GAP
    _draw_bar(canvas, (bar_x, top + _LINE, _BAR, large[1]), scale)

    scale = _greatest(levels, seen)
    font = _fitting_font(levels, small[0])
    for i, panel in enumerate(levels):
        column, row = i % columns, i // columns
        corner = _MARGIN + column * (small[0] + _GAP), second + row * (small[1] + _LINE + _GAP)
        _draw_panel(canvas, _coloured(panel, seen, scale), corner, small)
        _draw_title(canvas, panel.title, font, corner)
    _draw_bar(canvas, (bar_x, second + _LINE, _BAR, grid_height - _LINE), scale)
    return np.asarray(canvas)


def _fit(width: int, height: int, most_wide: int, most_high: int) -> tuple[int, int]:
    scale = min(most_wide / width, most_high / height)
    return max(1, round(width * scale)), max(1, round(height * scale))


def _greatest(panels: Sequence[Panel], seen: NDArray[np.bool_]) -> float:
    return max([1.0, *(float(panel.counts[seen].max()) for panel in panels if seen.any())])


def _fitting_font(panels: Sequence[Panel], width: int) -> Any:
    """The largest font in which every title fits over its panel; a tall, slim picture leaves room beside it."""
    fonts = [_font(size) for size in (18, 16, 14, 13, 12, 11, 10)]
    room = max(width, 220)
    fits = (font for font in fonts if all(font.getlength(panel.title) <= room for panel in panels))
    return next(fits, fonts[-1])


def _coloured(panel: Panel, seen: NDArray[np.bool_], scale: float) -> Image.Image:
    pixels = np.where(seen[..., None], heat(panel.counts, scale), np.asarray(_UNSEEN, dtype=np.uint8))
    return Image.fromarray(pixels)


def _draw_panel(canvas: Image.Image, picture: Image.Image, corner: tuple[int, int], size: tuple[int, int]) -> None:
    shrinks = size[0] < picture.width
    resampling = Image.Resampling.BOX if shrinks else Image.Resampling.NEAREST
    canvas.paste(picture.resize(size, resampling), (corner[0], corner[1] + _LINE))


def _draw_title(canvas: Image.Image, title: str, font: Any, corner: tuple[int, int]) -> None:
    ImageDraw.Draw(canvas).text((corner[0], corner[1] + _LINE - 6), title, fill=_INK, font=font, anchor="ls")


def _draw_bar(canvas: Image.Image, box: tuple[int, int, int, int], scale: float) -> None:
    draw = ImageDraw.Draw(canvas)
    x, y, width, height = box
    ramp = Image.fromarray(np.repeat(HEAT[::-1, None], width, axis=1))
    canvas.paste(ramp.resize((width, height), Image.Resampling.BILINEAR), (x, y))
    font = _font(13)
    for value in nice_ticks(scale, max(3, height // 60)):
        at = y + round((1 - value / scale) * (height - 1))
        draw.line([(x + width, at), (x + width + 4, at)], fill=_INK)
        draw.text((x + width + 8, at), f"{value:,.10g}", fill=_INK, font=font, anchor="lm")


def nice_ticks(top: float, most: int) -> list[float]:
    """Two to `most` + 1 values (`most` >= 3) from 0 to `top`, in steps of 1, 2, 5, 10, 20 ..."""
    step = max(1.0, 10.0 ** math.floor(math.log10(top / most)))
    while top / step > most:
        step *= 2.5 if f"{step:e}".startswith("2") else 2
    return [i * step for i in range(int(top / step) + 1)]


def _font(size: int) -> Any:
    return ImageFont.load_default(size)
