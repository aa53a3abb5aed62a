"""Colour: luminance, the sRGB curve, the tone map of the PNGs, and the colour map of the heatmaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear RGB (Rec. 709 primaries)."""

KNEE = 0.5
"""Where the tone map leaves the identity; middle greys lie well below."""

KEY = 0.15
"""Where :func:`auto_exposure` puts a picture's mean luminance: a little under middle grey, 0.18."""


def luminance(rgb: ArrayLike) -> Array:
    """(..., 3) linear RGB to (...) luminance; (..., 1) is taken as grey."""
    values: Array = np.asarray(rgb)
    weights = [1.0] if values.shape[-1] == 1 else LUMINANCE
    grey: Array = values @ np.asarray(weights, dtype=values.dtype)
    return grey


def srgb_encode(linear: ArrayLike) -> Array:
    """Linear [0, 1] to sRGB-encoded [0, 1], any shape (IEC 61966-2-1)."""
    values = np.clip(np.asarray(linear), 0, 1)
    encoded: Array = np.where(
        values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 1e-8) ** (1 / 2.4) - 0.055
    )
    return encoded


def srgb_decode(encoded: ArrayLike) -> Array:
    """sRGB-encoded [0, 1] to linear [0, 1], any shape: undoes :func:`srgb_encode`."""
    values = np.clip(np.asarray(encoded), 0, 1)
    linear: Array = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return linear


def tone_map(colour: ArrayLike, exposure: float = 1.0) -> Array:
    """(..., 3) linear radiance to linear [0, 1), for display.

    What is exposed below :data:`KNEE` stays as it is, so that albedos and middle greys look as lit. Above it the
    brightest channel p rolls off along ``KNEE + (1 - KNEE) t / (1 + t)``, t = (p - KNEE) / (1 - KNEE): no kink at the
    knee, white only at infinity. All channels are scaled alike, which keeps the hue, and then drawn toward
    white by the cube of the share of p that was rolled off, as bright light bleaches on film.
    """
    radiance: NDArray[np.float32] = np.asarray(colour, dtype=np.float32)
    # A pixel that is not a number shows as black, an infinite one as white; the EXR tells which it was.
    exposed = np.clip(np.nan_to_num(radiance * np.float32(exposure), nan=0.0), 0, np.float32(1e30))
    peak = np.asarray(exposed.max(axis=-1, keepdims=True))
    over = np.maximum(peak - KNEE, 0) / (1 - KNEE)
    rolled = np.where(peak > KNEE, KNEE + (1 - KNEE) * over / (1 + over), peak)
    safe = np.maximum(peak, np.float32(1e-30))
    scaled = exposed * (rolled / safe)
    bleach = ((peak - rolled) / safe) ** 3
    return np.asarray(scaled + (rolled - scaled) * bleach)


def auto_exposure(colour: ArrayLike, surface: ArrayLike) -> float:
    """The exposure that shows a picture well, for a scene that names none.

    The geometric mean of the luminance goes to :data:`KEY`, but no more than the brightest 5 % of pixels go beyond
    white twice over.

    Args:
        colour: (H, W, 3) linear radiance.
        surface: (H, W) bool, the pixels that count: those that see a surface.
    """
    seen = luminance(np.asarray(colour, dtype=np.float64))[np.asarray(surface, dtype=bool)]
    lit = seen[np.isfinite(seen) & (seen > 0)]
    if lit.size == 0:
        return 1.0
    # Black corners must not pull the mean down without end.
    mean = np.exp(np.mean(np.log(np.maximum(lit, 1e-3 * lit.mean()))))
    return float(min(KEY / mean, 2.0 / np.quantile(lit, 0.95)))


def to_bytes(colour: ArrayLike, exposure: float = 1.0) -> NDArray[np.uint8]:
    """(H, W, 3) linear radiance to the 8 bit sRGB pixels of a PNG, through :func:`tone_map`."""
    return np.rint(srgb_encode(tone_map(colour, exposure)) * 255).astype(np.uint8)


def _heat_table(size: int = 256) -> NDArray[np.uint8]:
    """Colours of even steps in OKLab lightness, deep blue to pale yellow, hue turning through violet and orange.

    OKLab (B. Ottosson, 2020) is used because equal steps of its L look equal; chroma is cut to what sRGB can show.
    """
    t = np.linspace(0, 1, size)
    lightness = 0.18 + 0.77 * t
    hue = np.radians(265 + 200 * t**0.85)
    wanted = 0.02 + 0.19 * np.sin(np.pi * np.clip(t * 0.92 + 0.06, 0, 1)) ** 0.8
    low, high = np.zeros(size), wanted
    for _ in range(30):
        middle = (low + high) / 2
        rgb = _oklab_to_linear(lightness, middle * np.cos(hue), middle * np.sin(hue))
        inside = ((rgb >= 0) & (rgb <= 1)).all(axis=-1)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    rgb = _oklab_to_linear(lightness, low * np.cos(hue), low * np.sin(hue))
    return np.rint(srgb_encode(rgb) * 255).astype(np.uint8)


def _oklab_to_linear(lightness: Array, a: Array, b: Array) -> Array:
    long = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
    medium = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
    short = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3
    return np.stack(
        [
            4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short,
            -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short,
            -0.0041960863 * long - 0.7034186147 * medium + 1.7076147010 * short,
        ],
        axis=-1,
    )


HEAT = _heat_table()
"""(256, 3) uint8: the colour map of the heatmaps, dark = few, bright = many."""


def heat(values: ArrayLike, top: float, table: NDArray[np.uint8] = HEAT) -> NDArray[np.uint8]:
    """(...) values from 0 to `top` as (..., 3) colours of an (n, 3) table; what lies beyond takes the end's colour."""
    scaled = np.asarray(values, dtype=np.float64) / top if top > 0 else np.zeros(np.shape(values))
    return table[np.clip(np.rint(scaled * (len(table) - 1)), 0, len(table) - 1).astype(np.intp)]
