"""Textures in float64: sRGB decoding, repeat, bilinear; texel (0, 0) is the top left, centres at halves."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def srgb_to_linear(s: ArrayLike) -> Array:
    """IEC 61966-2-1."""
    s = np.asarray(s, np.float64)
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def decoded(texture: NDArray[np.uint8]) -> Array:
    """(h, w, 4): linear RGB and alpha."""
    unit = texture.astype(np.float64) / 255
    return np.concatenate([srgb_to_linear(unit[..., :3]), unit[..., 3:]], axis=-1)


def bilinear(texture: NDArray[np.uint8], uv: Array) -> Array:
    """(n, 4) linear RGB and alpha at (n, 2) `uv`: the hat-weighted sum of all texels and their repeats."""
    texels = decoded(texture)
    height, width = texels.shape[:2]

    def weights(t: Array, size: int) -> Array:
        centres = np.arange(size) + 0.5
        gap = np.abs((t[:, None] * size - centres[None] + size / 2) % size - size / 2)
        return np.ones((len(t), 1)) if size == 1 else np.maximum(0.0, 1 - gap)

    wx, wy = weights(uv[:, 0], width), weights(uv[:, 1], height)
    return np.einsum("ny,nx,yxc->nc", wy, wx, texels)
