"""Pixels as files in memory, quickly: what goes to the browser."""

from __future__ import annotations

import base64
import io
import zlib

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Pixels = NDArray[np.uint8]


def png_bytes(pixels: Pixels) -> bytes:
    """(H, W, 3) sRGB bytes as PNG: exact, packed lightly."""
    return _saved(pixels, "PNG", compress_level=1, compress_type=zlib.Z_RLE)


def jpeg_bytes(pixels: Pixels, quality: int = 90) -> bytes:
    """(H, W, 3) sRGB bytes as JPEG with full colour resolution: smaller, not exact."""
    return _saved(pixels, "JPEG", quality=quality, subsampling=0)


def data_url(pixels: Pixels, jpeg: bool = False) -> str:
    """The picture as the address of an ``<img>``."""
    return image_url(jpeg_bytes(pixels), "jpeg") if jpeg else image_url(png_bytes(pixels))


def image_url(data: bytes, kind: str = "png") -> str:
    """An image file as the address of an ``<img>``."""
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"


def _saved(pixels: Pixels, kind: str, **options: int) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, format=kind, **options)
    return buffer.getvalue()
