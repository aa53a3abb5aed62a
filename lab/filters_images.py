"""Pictures as torch tensors, and how a filter's taps read them: reflected at borders, as one batch a pass.

A pass of step s sees s x s sub-images, each of every s-th pixel. Dealt into a batch they need no dilated taps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.records import Floats

if TYPE_CHECKING:
    from torch import Tensor

LUMINANCE = (0.2126, 0.7152, 0.0722)
STEPS = (1, 2, 4, 8, 16)  # of the five passes of an a-trous filter
BORDER = 2  # pixels that `deal` adds on every side of a sub-image: the reach of a 5 x 5 window

Blur = Callable[["Tensor", "Tensor"], "Tensor"]  # (signal, guide), (n, c, h + 4, w + 4) each, to (n, c', h, w)


def tensor(pixels: NDArray[Any]) -> Tensor:
    """(H, W, C) numbers as a (1, C, H, W) float32 tensor on the fastest device."""
    import torch

    device = "cuda" if torch.cuda.is_available() else "cpu"
    planes = np.ascontiguousarray(np.moveaxis(pixels, 2, 0)[None], dtype=np.float32)
    return torch.from_numpy(planes).to(device)


def pixels(planes: Tensor) -> Floats:
    """The reverse of :func:`tensor`."""
    array: Floats = np.moveaxis(planes[0].cpu().numpy(), 0, 2)
    return array


def luminance(colours: Tensor) -> Tensor:
    """(n, 1, h, w) luminance of (n, 3, h, w) linear RGB; a single channel is its own."""
    import torch

    if colours.shape[1] == 1:
        return colours
    weights = torch.tensor(LUMINANCE, device=colours.device, dtype=colours.dtype)
    return (colours * weights.view(1, 3, 1, 1)).sum(1, keepdim=True)


def reflected(pixel: NDArray[np.int64], step: int, length: int) -> NDArray[np.int64]:
    """The pixels that taps at `pixel` (any whole numbers) read in a row of `length` pixels.

    A pass of step s sees s separate sub-images, the pixels of each residue modulo s, and reflects inside its own
    (without repeating the edge; again and again where a sub-image is short). Every residue must have a pixel.
    """
    residue = pixel % step
    size = (length - residue + step - 1) // step
    period = np.maximum(2 * (size - 1), 1)
    index = (pixel - residue) // step % period
    return np.asarray(residue + step * np.where(index < size, index, period - index))


def read(image: Tensor, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Tensor:
    """The pixels of (1, C, H, W) at `rows` x `columns`."""
    import torch

    for axis, index in ((2, rows), (3, columns)):
        image = image.index_select(axis, torch.from_numpy(index).to(image.device))
    return image


def by_sub_images(blur: Blur, step: int, signal: Tensor, guide: Tensor) -> Tensor:
    """One pass of step `step`: `blur` on all sub-images of `signal` and `guide` (1, C, H, W) at once."""
    height, width = signal.shape[2:]
    rows, columns = _sub_images(height, step), _sub_images(width, step)
    blurred = blur(_deal(signal, rows, columns), _deal(guide, rows, columns))
    inner = blurred.reshape(len(rows), len(columns), *blurred.shape[1:])
    together = inner.permute(2, 3, 0, 4, 1).flatten(3, 4).flatten(1, 2)  # (C, h, ry, w, rx) -> (C, h ry, w rx)
    return together[None, :, :height, :width]


def at_tap(dy: int, dx: int) -> tuple[slice, ...]:
    """Index of what each pixel's tap (dx, dy) reads in sub-images with their borders; (0, 0): the pixels themselves."""
    return (slice(None), slice(None), *(slice(BORDER + d, d - BORDER or None) for d in (dy, dx)))


def _sub_images(length: int, step: int) -> NDArray[np.int64]:
    """(sub-images, positions + 2 BORDER): what each sub-image of a row reads, borders included."""
    count = (length + step - 1) // step
    residue = np.arange(min(step, length))[:, None]
    return reflected(residue + step * np.arange(-BORDER, count + BORDER), step, length)


def _deal(image: Tensor, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Tensor:
    """(1, C, H, W) to the batch of its sub-images, borders included: (ry rx, C, h, w)."""
    dealt = read(image, rows.ravel(), columns.ravel()).reshape(-1, *rows.shape, *columns.shape)
    return dealt.permute(1, 3, 0, 2, 4).flatten(0, 1)
