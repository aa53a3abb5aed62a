"""Pictures inside a page: PNGs as data URIs, small enough to be many."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lab.colour import to_bytes
from lab.error_picture import SIGNED, round_up

Doubles = NDArray[np.float64]

WIDEST = 640
_STEPS = 62  # even: 0 is white


@dataclass(frozen=True)
class Picture:
    """A data URI and its size; `scale` is what the ends of the colour bar stand for, 0 for a photograph."""

    uri: str
    width: int
    height: int
    scale: float = 0.0


def photograph(colour: Doubles, exposure: float) -> Picture:
    """(H, W, 3) linear radiance, tone-mapped."""
    return _picture(Image.fromarray(to_bytes(_shrunk(colour), exposure)), 0.0)


def signed(error: Doubles) -> Picture:
    """(H, W) signed relative errors: blue below 0, red above; the worst 1 % take the colours of the ends."""
    shrunk = np.nan_to_num(_shrunk(error[..., None])[..., 0])
    scale = round_up(float(np.quantile(np.abs(shrunk), 0.99)))
    steps = np.clip(np.rint((shrunk / scale + 1) / 2 * _STEPS), 0, _STEPS)
    image = Image.fromarray(steps.astype(np.uint8))
    # A palette of few colours: noise takes a quarter of the space.
    image.putpalette(SIGNED[np.rint(np.arange(_STEPS + 1) / _STEPS * 255).astype(int)].tobytes())
    return _picture(image, scale)


def gradient() -> str:
    """The colour bar of :func:`signed`, as CSS."""
    stops = ", ".join("rgb({} {} {})".format(*SIGNED[i]) for i in np.linspace(0, 255, 17).round().astype(int))
    return f"linear-gradient(to right, {stops})"


def _shrunk(pixels: Doubles) -> Doubles:
    """Means over squares of pixels where the picture is wider than :data:`WIDEST`."""
    times = -(-pixels.shape[1] // WIDEST)
    height, width = (max(1, side // times) for side in pixels.shape[:2])
    if times == 1 or pixels.shape[0] < times:
        return pixels
    cut = pixels[: height * times, : width * times]
    return np.asarray(cut.reshape(height, times, width, times, -1).mean(axis=(1, 3)), np.float64)


def _picture(image: Image.Image, scale: float) -> Picture:
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", optimize=True)
    uri = f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"
    return Picture(uri, image.width, image.height, scale)
