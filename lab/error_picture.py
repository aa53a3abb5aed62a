"""What a comparison looks like: two images side by side, the signed error of one, and where a person sees it (FLIP)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from lab.colour import HEAT, auto_exposure, heat, luminance, srgb_encode, to_bytes
from lab.figure import (
    BAR,
    GAP,
    LABEL,
    LINE,
    MARGIN,
    PAPER,
    TALLEST,
    WIDTH,
    draw_bar,
    draw_panel,
    draw_title,
    fit,
    font,
    nice_ticks,
)
from lab.metrics import relative_error

Pixels = NDArray[np.uint8]
Array = NDArray[np.float64]
Ticks = Sequence[tuple[float, str]]

_NARROWEST, _SHORTEST_BAR = 560, 120  # Room for a title over a slim picture, and for labels beside a low one.
_TITLE, _SUBTITLE = 16, 12
_FRAME = (205, 204, 200)


def _signed_table(half: int = 128) -> Pixels:
    """White seen through a filter whose density grows with the magnitude: blue below 0, red above."""
    density = np.linspace(0, 1, half)[:, None] ** 0.8
    below, above = (np.exp(-density * absorbed) for absorbed in ([3.4, 1.9, 0.35], [0.35, 2.6, 3.4]))
    return np.rint(srgb_encode(0.95 * np.concatenate([below[::-1], above])) * 255).astype(np.uint8)


def _magma_table() -> Pixels:
    """The colours FLIP maps are shown in everywhere: every 17th of the 256 of magma, and straight lines between.

    Magma is by S. van der Walt and N. Smith (CC0).
    """
    words = """000004 0b0924 20114b 3b0f70 57157e 721f81 8c2981 a8327d c43c75 de4968 f1605d fa7f5e fe9f6d febf84 fddea0
    fcfdbf"""
    points = np.array([list(bytes.fromhex(word)) for word in words.split()], dtype=np.float64)
    steps = np.arange(256)
    channels = [np.interp(steps, steps[::17], points[:, c]) for c in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


SIGNED = _signed_table()
"""(256, 3) uint8: the colour map of signed errors; blue: too dark, white: right, red: too bright."""

MAGMA = _magma_table()
"""(256, 3) uint8: the colour map of FLIP, black: the same, bright: another picture."""


@dataclass(frozen=True)
class Panel:
    """A picture with its title and a smaller line under that; `pixels` are (H, W, 3) sRGB bytes."""

    title: str
    subtitle: str
    pixels: Pixels


def draw_side_by_side(image: Array, reference: Array, names: tuple[str, str]) -> Pixels:
    """Both images, (H, W, 3) or (H, W), shown alike: light at the reference's exposure, the rest by scale.

    `names` are their titles. Returns the (h, w, 3) sRGB bytes of the page.
    """
    both = np.stack([image, reference])
    if image.ndim == 3 and both.min() >= 0:
        exposure = auto_exposure(reference, np.ones(reference.shape[:2], bool))
        said = f"both at the exposure that suits B, {exposure:.4g}"
        return _page([Panel(name, said, to_bytes(x, exposure)) for name, x in zip(names, both, strict=True)])
    low, high = min(0.0, float(both.min())), float(both.max())
    reach = (high - low) or 1.0
    if image.ndim == 3:
        scaled = np.rint((both - low) / reach * 255).astype(np.uint8)
        said = f"from {low:.4g} (black) to {high:.4g}"
        return _page([Panel(name, said, x) for name, x in zip(names, scaled, strict=True)])
    ticks = [(place, f"{low + place * reach:.4g}") for place in np.linspace(0, 1, 5)]
    panels = [Panel(name, "", heat(x - low, reach)) for name, x in zip(names, both, strict=True)]
    return _page(panels, HEAT, ticks)


def draw_error(image: Array, reference: Array, title: str) -> Pixels:
    """The signed relative error of each pixel's luminance, (a - b) / sqrt(b^2 + e^2), under a bar with its values.

    `image` and `reference` are (H, W, 3) or (H, W). The scale holds all but the worst 1 % of pixels; those take the
    colour of its ends. Returns the (h, w, 3) sRGB bytes of the page.
    """
    a, b = (x if x.ndim == 2 else np.asarray(luminance(x), np.float64) for x in (image, reference))
    error = np.nan_to_num(relative_error(a, b))
    scale = round_up(float(np.quantile(np.abs(error), 0.99)))
    ticks = [(place, _percent(scale * (2 * place - 1))) for place in (0, 0.25, 0.5, 0.75, 1)]
    what = ("brighter", "darker", "B's luminance") if image.ndim == 3 else ("greater", "less", "B")
    said = f"red: A is {what[0]} than B, blue: {what[1]}; relative to {what[2]}, floored at 1 % of its mean"
    return _page([Panel(title, said, heat(error + scale, 2 * scale, SIGNED))], SIGNED, ticks)


def draw_flip(error_map: NDArray[np.float32], title: str, subtitle: str) -> Pixels:
    """An (H, W) FLIP map from 0 to 1 under a bar with its values; the (h, w, 3) sRGB bytes of the page."""
    ticks = [(value, f"{value:.1f}") for value in nice_ticks(1.0, 5, least=0.1)]
    return _page([Panel(title, subtitle, heat(error_map, 1.0, MAGMA))], MAGMA, ticks)


def round_up(value: float) -> float:
    """The next of 0.01, 0.02, 0.05, 0.1 ... 1, 2 that is at least `value`; never beyond these."""
    return next((step for step in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0) if step >= value), 2.0)


def _percent(value: float) -> str:
    return "0" if value == 0 else f"{100 * value:+.3g} %"


def _page(panels: list[Panel], ramp: Pixels | None = None, ticks: Ticks = ()) -> Pixels:
    """Panels from left to right, then the bar of `ramp`, if any."""
    height, width = panels[0].pixels.shape[:2]
    size = _shown_size(width, height)
    room = max(size[0], _NARROWEST)
    tall = size[1] if ramp is None else max(size[1], _SHORTEST_BAR)
    head = MARGIN + LINE  # The subtitle takes the line that draw_panel leaves free.
    right = GAP + BAR + LABEL if ramp is not None else MARGIN
    page = (MARGIN + len(panels) * room + (len(panels) - 1) * GAP + right, head + LINE + tall + MARGIN)
    canvas = Image.new("RGB", page, PAPER)
    for i, panel in enumerate(panels):
        x = MARGIN + i * (room + GAP)
        for text, letters, y in ((panel.title, font(_TITLE), MARGIN), (panel.subtitle, font(_SUBTITLE), head)):
            draw_title(canvas, _shortened(text, letters, room), letters, (x, y))
        frame = x - 1, head + LINE - 1, x + size[0], head + LINE + size[1]
        ImageDraw.Draw(canvas).rectangle(frame, outline=_FRAME)
        draw_panel(canvas, panel.pixels, (x, head), size)
    if ramp is not None:
        draw_bar(canvas, (page[0] - LABEL - BAR, head + LINE, BAR, tall), ramp, ticks)
    return np.asarray(canvas)


def _shown_size(width: int, height: int) -> tuple[int, int]:
    """Every pixel as one square, or as a larger one where the image is small; only a huge image shrinks."""
    times = min(WIDTH // width, TALLEST // height)
    if times >= 1:
        return width * times, height * times
    return min((width, height), fit(width, height, 2 * WIDTH, 2 * TALLEST))


def _shortened(text: str, letters: Any, room: int) -> str:
    if letters.getlength(text) <= room:
        return text
    keep = math.floor(len(text) * room / letters.getlength(text)) - 3
    while letters.getlength(f"{text[:keep]}...") > room:
        keep -= 1
    return f"{text[:keep]}..."
