"""Textures on the device: all mip levels in one buffer, made as in core_cpp/src/texture.cpp."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

TEXTURE = np.dtype([("first_mip", "u4"), ("last", "u4"), ("half_log2_texels", "f4"), ("unused", "u4")])
MIP = np.dtype([("first", "u4"), ("width", "i4"), ("height", "i4"), ("unused", "u4")])

_MOST_TEXELS = 2**30
"""A buffer holds 4 GiB."""


def upload_textures(gpu: Gpu, images: list[NDArray[np.uint8]]) -> dict[str, Any]:
    """The value of a shader's ``TextureBuffers``."""
    rows = np.zeros(len(images), TEXTURE)
    mips: list[tuple[int, int, int, int]] = []
    levels: list[NDArray[np.uint8]] = []
    first = 0
    for row, image in zip(rows, images, strict=True):
        chain = mip_chain(image)
        texels = image.shape[0] * image.shape[1]
        row["first_mip"], row["last"] = len(mips), len(chain) - 1
        row["half_log2_texels"] = np.float32(0.5) * np.log2(np.float32(texels))
        for level in chain:
            height, width = level.shape[:2]
            mips.append((first, width, height, 0))
            first += height * width
        levels += chain
    if first > _MOST_TEXELS:
        raise LabError(f"the scene's textures have {first:,} texels with all mip levels: the Vulkan engine takes 2^30")
    flat = [np.ascontiguousarray(level).reshape(-1, 4).view("<u4")[:, 0] for level in levels]
    pool = gpu.pool
    return {
        "rows": pool.upload(rows, "textures"),
        "mips": pool.upload(np.array(mips, MIP), "mip levels"),
        "texels": pool.upload(np.concatenate([np.zeros(0, np.uint32), *flat]), "texels"),
        "linear_of_srgb": pool.upload(_LINEAR_OF_SRGB, "linear of sRGB"),
    }


def mip_chain(image: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """The (h, w, 4) image and its halves, down to one texel."""
    chain = [image]
    while chain[-1].shape[0] > 1 or chain[-1].shape[1] > 1:
        chain.append(_halved(chain[-1]))
    return chain


def _halved(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Means of 2 x 2 texels, of colour in linear light."""
    height, width = image.shape[:2]
    x, y = np.arange(max(1, width // 2)) * 2, np.arange(max(1, height // 2)) * 2
    right, below = np.minimum(x + 1, width - 1), np.minimum(y + 1, height - 1)
    total = np.zeros((len(y), len(x), 4), np.float32)
    for rows in (y, below):
        for columns in (x, right):
            texel = image[np.ix_(rows, columns)]
            total[..., :3] += _LINEAR_OF_SRGB[texel[..., :3]]
            total[..., 3] += texel[..., 3].astype(np.float32) / np.float32(255)
    mean = total / np.float32(4)
    mean[..., :3] = _linear_to_srgb(mean[..., :3])
    # Halves are rounded up, not to even.
    half: NDArray[np.uint8] = np.floor(np.clip(mean, 0, 1) * np.float32(255) + np.float32(0.5)).astype(np.uint8)
    return half


# IEC 61966-2-1.
def _srgb_to_linear(s: NDArray[np.float32]) -> NDArray[np.float32]:
    power = ((s + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.where(s <= np.float32(0.04045), s / np.float32(12.92), power).astype(np.float32)


def _linear_to_srgb(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    power = np.float32(1.055) * linear ** np.float32(1 / 2.4) - np.float32(0.055)
    return np.where(linear <= np.float32(0.0031308), linear * np.float32(12.92), power).astype(np.float32)


_LINEAR_OF_SRGB = _srgb_to_linear(np.arange(256, dtype=np.float32) / np.float32(255))
