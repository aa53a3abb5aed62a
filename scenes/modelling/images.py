"""Textures as image files in memory, and the periodic noise they are painted with."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from modelling.mesh import Floats


@dataclass(frozen=True)
class Texture:
    """An encoded image."""

    name: str
    data: bytes
    mime: str


def srgb(linear: ArrayLike) -> NDArray[np.uint8]:
    """Linear 0..1 to 8-bit sRGB."""
    x = np.clip(np.asarray(linear, dtype=np.float64), 0, 1)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


def jpeg(name: str, linear: Floats, quality: int = 80) -> Texture:
    """`linear` (h, w, 3) reflectance as a JPEG."""
    data = io.BytesIO()
    Image.fromarray(srgb(linear)).save(data, "JPEG", quality=quality, optimize=True)
    return Texture(name, data.getvalue(), "image/jpeg")


def png(name: str, rgba: NDArray[np.uint8]) -> Texture:
    """`rgba` (h, w, 4), 8-bit sRGB and alpha, as a PNG; not deflated, so that any zlib writes the same bytes."""
    data = io.BytesIO()
    Image.fromarray(rgba).save(data, "PNG", compress_level=0)
    return Texture(name, data.getvalue(), "image/png")


def noise(size: int, rng: np.random.Generator, slope: float = 1.0, lowest: float = 2, stretch: float = 1.0) -> Floats:
    """(size, size) periodic noise of mean 0 and deviation 1 with amplitudes falling as frequency^-`slope`.

    `lowest` is the lowest frequency in waves a side; `stretch` > 1 draws it out along v (stains that run down).
    """
    f = np.fft.fftfreq(size, 1 / size)
    frequency = np.hypot(np.fft.rfftfreq(size, 1 / size)[None, :], f[:, None] * stretch)
    amplitude = np.where(frequency >= lowest, np.maximum(frequency, 1) ** -slope, 0)
    white = np.fft.rfft2(rng.standard_normal((size, size)))
    field = np.fft.irfft2(white * amplitude, s=(size, size))
    return np.asarray((field - field.mean()) / field.std(), dtype=np.float64)


def cells(size: int) -> tuple[Floats, Floats]:
    """Coordinates u (columns) and v (rows) of the texels' centres, 0..1, each (size, size)."""
    at = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(at, at)
    return u, v


def tint(colour: ArrayLike, shade: Floats) -> Floats:
    """`colour` (3,) times `shade` (h, w) -> (h, w, 3)."""
    return shade[..., None] * np.asarray(colour, dtype=np.float64)


def blend(a: Floats, b: Floats, weight: Floats) -> Floats:
    """`a` where `weight` (h, w) is 0, `b` where it is 1; colours (h, w, 3) or (3,)."""
    w = np.clip(weight, 0, 1)[..., None]
    return a * (1 - w) + b * w


def smooth_step(low: float, high: float, x: Floats) -> Floats:
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
