"""Two pictures in one: a wipe with a divider, and the difference of two layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gui.layers.picture import draw
from gui.layers.scale import scale_for
from gui.legend import Legend, legend
from lab.colour import luminance
from lab.errors import LabError
from lab.figure import font
from lab.layers import LIGHT, SIGNED, Layer
from lab.metrics import relative_error

Pixels = NDArray[np.uint8]


def wipe(a: Pixels, b: Pixels, at: float, labels: tuple[str, str] = ("A", "B")) -> Pixels:
    """`a` left of the share `at` of the width, `b` right of it, with a divider and a label in each upper corner.

    Both are (H, W, 3) sRGB bytes of one size.
    """
    if a.shape != b.shape or a.ndim != 3:
        raise LabError(f"a wipe takes two pictures of one size, got {a.shape} and {b.shape}")
    if not 0 <= at <= 1:
        raise LabError(f"wipe at {at:g}: expected a share of the width from 0 to 1")
    height, width = a.shape[:2]
    x = round(at * width)
    canvas = Image.fromarray(np.concatenate([a[:, :x], b[:, x:]], axis=1))
    draw_on = ImageDraw.Draw(canvas, "RGBA")
    draw_on.rectangle((x - 2, 0, x + 1, height - 1), fill=(0, 0, 0, 110))
    draw_on.rectangle((x - 1, 0, x, height - 1), fill=(255, 255, 255, 255))
    letters = font(max(11, min(16, height // 24)))
    for label, left, right in ((labels[0], 0, x), (labels[1], x, width)):
        room = round(letters.getlength(label)) + 14
        if not label or room + 12 > right - left:
            continue  # the side is too narrow to be named
        tall = letters.size + 8
        start = left + 6 if left == 0 else right - 6 - room
        draw_on.rounded_rectangle((start, 6, start + room, 6 + tall), 4, fill=(20, 20, 24, 170))
        draw_on.text((start + 7, 6 + tall / 2), label, fill=(255, 255, 255, 255), font=letters, anchor="lm")
    return np.asarray(canvas)


@dataclass(frozen=True)
class Difference:
    """How two layers differ: (H, W) signed values, their (H, W, 3) pixels and legend."""

    values: NDArray[Any]
    pixels: Pixels
    legend: Legend


def difference(a: NDArray[Any], b: NDArray[Any], layer: Layer, seen: NDArray[np.bool_] | None = None) -> Difference:
    """A minus B, red where A is more.

    For light: of the luminance, relative to B's (:func:`lab.metrics.relative_error`); for anything else a plain
    difference in the layer's unit, of three channels the one that differs most.
    """
    if a.shape != b.shape:
        raise LabError(f"a difference takes two layers of one size, got {a.shape} and {b.shape}")
    if layer.kind == LIGHT:
        values = relative_error(luminance(np.asarray(a, np.float64)), luminance(np.asarray(b, np.float64)))
        shown = Layer("difference", f"{layer.title}: A - B, relative to B", "", SIGNED, "%", colour_map="signed")
        scale = scale_for(shown, values, seen)
    else:
        values = np.asarray(a, np.float64) - np.asarray(b, np.float64)
        if values.ndim == 3:
            most = np.abs(np.nan_to_num(values)).argmax(axis=-1)
            values = np.take_along_axis(values, most[..., None], axis=-1)[..., 0]
        shown = Layer("difference", f"{layer.title}: A - B", "", "scalar", layer.unit, colour_map="signed")
        chosen = values if seen is None else values[seen]
        known = np.abs(chosen[np.isfinite(chosen)])
        reach = float(known.max()) if known.size and known.max() > 0 else 1.0
        scale = scale_for(shown, values, seen, low=-reach, high=reach)
    return Difference(values, draw(values, shown.kind, scale, seen, 1.0), legend(shown, scale=scale))
