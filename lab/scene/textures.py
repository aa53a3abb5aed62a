"""Image bytes to textures, and sRGB to linear light."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from lab.records import Floats
from lab.scene.quiet import quiet

Texture = NDArray[np.uint8]
MAX_PIXELS = 16384 * 16384


def srgb_to_linear(values: NDArray[np.floating]) -> Floats:
    """Linear light of sRGB-encoded `values` in 0..1, any shape (IEC 61966-2-1)."""
    encoded = np.asarray(values, dtype=np.float64)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)


def bytes_to_linear(values: NDArray[np.uint8]) -> Floats:
    """Linear light of sRGB bytes, any shape."""
    return srgb_to_linear(np.arange(256) / 255.0)[values]


def decode_image(data: bytes) -> Texture | None:
    """The picture in `data` (JPEG, PNG or another format Pillow knows) as (h, w, 4) RGBA, or None if it is broken."""
    from PIL import Image

    with quiet():
        try:
            with Image.open(io.BytesIO(data)) as image:
                if image.width * image.height > MAX_PIXELS:
                    return None
                return np.ascontiguousarray(np.asarray(image.convert("RGBA"), dtype=np.uint8))
        except Exception:  # Pillow's decoders raise whatever they meet: OSError, SyntaxError, ValueError, struct.error
            return None


def is_image(data: bytes) -> bool:
    """True where `data` begins as a picture Pillow knows."""
    from PIL import Image

    with quiet():
        try:
            with Image.open(io.BytesIO(data)):
                return True
        except Exception:  # as in decode_image
            return False


def mean_colour(texture: Texture) -> NDArray[np.float64]:
    """(3,) mean linear RGB of `texture`."""
    table = srgb_to_linear(np.arange(256) / 255.0).astype(np.float64)
    return (
        np.array([np.bincount(texture[..., c].ravel(), minlength=256) @ table for c in range(3)]) / texture[..., 0].size
    )
