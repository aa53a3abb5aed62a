"""Parts of a drawn page: pictures at a size that fits, titles, and colour bars with values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

WIDTH, TALLEST = 960, 720
"""Largest panel, in pixels of the picture."""

MARGIN, GAP, BAR, LABEL, LINE = 24, 14, 18, 64, 26
"""Edge of the page, space between panels, width of a colour bar and of its labels, height of a title."""

PAPER, INK = (250, 249, 246), (32, 32, 36)

Box = tuple[int, int, int, int]
Pixels = NDArray[np.uint8]


def fit(width: int, height: int, most_wide: int, most_high: int) -> tuple[int, int]:
    """The greatest size of the same shape."""
    scale = min(most_wide / width, most_high / height)
    return max(1, round(width * scale)), max(1, round(height * scale))


def font(size: int) -> Any:
    """The font of all pages."""
    return ImageFont.load_default(size)


def fitting_font(titles: Sequence[str], width: int) -> Any:
    """The largest font in which every title fits over its panel; a tall, slim picture leaves room beside it."""
    fonts = [font(size) for size in (18, 16, 14, 13, 12, 11, 10)]
    room = max(width, 220)
    fits = (candidate for candidate in fonts if all(candidate.getlength(title) <= room for title in titles))
    return next(fits, fonts[-1])


def draw_title(canvas: Image.Image, title: str, title_font: Any, corner: tuple[int, int]) -> None:
    """Writes a title of height :data:`LINE` from its upper left corner."""
    ImageDraw.Draw(canvas).text((corner[0], corner[1] + LINE - 6), title, fill=INK, font=title_font, anchor="ls")


def draw_panel(canvas: Image.Image, pixels: Pixels, corner: tuple[int, int], size: tuple[int, int]) -> None:
    """Draws (H, W, 3) `pixels` at `size` under a title at `corner`: averaged where it shrinks."""
    picture = Image.fromarray(pixels)
    resampling = Image.Resampling.BOX if size[0] < picture.width else Image.Resampling.NEAREST
    canvas.paste(picture.resize(size, resampling), (corner[0], corner[1] + LINE))


def draw_bar(canvas: Image.Image, box: Box, ramp: Pixels, ticks: Sequence[tuple[float, str]]) -> None:
    """Draws an upright colour bar of (n, 3) `ramp`, lowest first, in `box` (x, y, width, height).

    `ticks` are the places of the labels, from 0 (bottom) to 1 (top), and their texts.
    """
    draw = ImageDraw.Draw(canvas)
    x, y, width, height = box
    colours = Image.fromarray(np.repeat(ramp[::-1, None], width, axis=1))
    canvas.paste(colours.resize((width, height), Image.Resampling.BILINEAR), (x, y))
    for place, label in ticks:
        at = y + round((1 - place) * (height - 1))
        draw.line([(x + width, at), (x + width + 4, at)], fill=INK)
        draw.text((x + width + 8, at), label, fill=INK, font=font(13), anchor="lm")


def nice_ticks(top: float, most: int, least: float = 1.0) -> list[float]:
    """Two to `most` + 1 values (`most` >= 3) from 0 to `top`, in steps of `least` or more: 1, 2, 5, 10, 20 ..."""
    step = max(least, 10.0 ** math.floor(math.log10(top / most)))
    while top / step > most:
        step *= 2.5 if f"{step:e}".startswith("2") else 2
    return [i * step for i in range(int(top / step) + 1)]
