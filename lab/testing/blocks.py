"""A picture dealt to blocks of pixels: their means, the whole's, and what each is called."""

from __future__ import annotations

import numpy as np

from lab.testing.pictures import Array


class Blocks:
    """Blocks of `side` x `side` pixels of a picture of `shape` = (H, W) or (H, W, 3).

    A vector over blocks holds n values: block by block in rows, channel by channel in each, then the whole picture's
    channels.

    Attributes:
        pixels: (n,) how many pixels each value is the mean of.

    """

    def __init__(self, shape: tuple[int, ...], side: int) -> None:
        self._shape = (*shape[:2], shape[2] if len(shape) == 3 else 1)
        self._grey = len(shape) == 2
        self._starts = [np.arange(0, length, side) for length in shape[:2]]
        self._ends = [np.append(starts[1:], length) for starts, length in zip(self._starts, shape[:2], strict=True)]
        heights, widths = (ends - starts for starts, ends in zip(self._starts, self._ends, strict=True))
        counts = np.repeat(np.outer(heights, widths).ravel(), self._shape[2])
        self.pixels = np.append(counts, np.full(self._shape[2], shape[0] * shape[1])).astype(np.float64)

    def means(self, picture: Array) -> Array:
        """The vector of means."""
        sums = picture.reshape(self._shape)
        whole = sums.sum(axis=(0, 1))
        for axis, starts in enumerate(self._starts):
            sums = np.add.reduceat(sums, starts, axis=axis)
        vector: Array = np.append(sums.ravel(), whole) / self.pixels
        return vector

    def spread(self, vector: Array) -> Array:
        """A picture of the original shape in which each pixel has its block's value."""
        rows, columns = (ends - starts for starts, ends in zip(self._starts, self._ends, strict=True))
        values = vector[: -self._shape[2]].reshape(len(rows), len(columns), self._shape[2])
        picture = np.repeat(np.repeat(values, rows, axis=0), columns, axis=1)
        return picture[..., 0] if self._grey else picture

    def whole_share(self, error: Array, mean: Array) -> float:
        """The greatest of the whole picture's channels' `error` / `mean`; 0 for a black picture."""
        shares = [e / abs(m) for e, m in zip(error[-self._shape[2] :], mean[-self._shape[2] :], strict=True) if m]
        return float(max(shares, default=0.0))

    def name(self, index: int, corner: tuple[int, int]) -> str:
        """What value `index` of a vector is the mean of; `corner` = (x, y) of the picture in a larger one."""
        block, channel = divmod(int(index), self._shape[2])
        colour = "" if self._grey else " " + "RGB"[channel]
        row, column = divmod(block, len(self._starts[1]))
        if row == len(self._starts[0]):
            return f"whole picture{colour}"
        x, y = (
            f"{self._starts[axis][i] + start}..{self._ends[axis][i] - 1 + start}"
            for axis, i, start in ((1, column, corner[0]), (0, row, corner[1]))
        )
        return f"x={x} y={y}{colour}"
