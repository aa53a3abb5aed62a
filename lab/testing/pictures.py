"""The two pictures that an assertion compares: their shape, a region of them, where they differ most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError

Array = NDArray[np.float64]
Region = tuple[int, int, int, int]
"""x, y, width, height in pixels, from the upper left corner."""


@dataclass(frozen=True)
class Pair:
    """What is judged: (H, W) or (H, W, 3) float64, all finite; `corner` = (x, y) of it in the given pictures."""

    image: Array
    reference: Array
    corner: tuple[int, int] = (0, 0)


def as_picture(name: str, picture: ArrayLike) -> Array:
    """`picture` as float64 (H, W) or (H, W, 3), or a :class:`LabError`."""
    if any(hasattr(picture, layer) for layer in ("image", "colour", "indirect")):
        layer = "image.indirect" if hasattr(picture, "image") else "indirect"
        raise LabError(f"{name} is a whole {type(picture).__name__}: give one layer of it, for example .{layer}")
    try:
        values = np.asarray(picture, np.float64)
    except (TypeError, ValueError):
        raise LabError(f"{name}: expected numbers of shape (height, width, 3), got {picture!r:.60}") from None
    if values.ndim not in (2, 3) or values.size == 0 or (values.ndim == 3 and values.shape[2] not in (1, 3)):
        raise LabError(f"{name}: expected shape (height, width, 3) or (height, width), got {values.shape}")
    return values[..., 0] if values.ndim == 3 and values.shape[2] == 1 else values


def as_pair(image: ArrayLike, reference: ArrayLike, region: Region | None) -> Pair:
    """Both pictures, cut to the `region`.

    Raises:
        LabError: for shapes that differ and for a region that does not lie in them.
        AssertionError: for a value that is not finite; the message tells how many and where the first is.

    """
    __tracebackhide__ = True
    a, b = as_picture("image", image), as_picture("reference", reference)
    check_same_shape("image", a, b)
    for name, picture in (("image", a), ("reference", b)):
        check_finite(name, cut(picture, region), region)
    return Pair(cut(a, region), cut(b, region), (0, 0) if region is None else region[:2])


def cut(picture: Array, region: Region | None) -> Array:
    """The `region` of a picture, or a :class:`LabError` where it does not lie in it."""
    if region is None:
        return picture
    height, width = picture.shape[:2]
    if len(region) == 4 and all(isinstance(side, (int, np.integer)) for side in region):
        x, y, w, h = region
        if 0 <= x < x + w <= width and 0 <= y < y + h <= height:
            return picture[y : y + h, x : x + w]
    raise LabError(f"region={region}: expected (x, y, width, height) that lie in a picture of {width}x{height} pixels")


def check_same_shape(name: str, image: Array, reference: Array) -> None:
    """Raises :class:`LabError` where two pictures differ in size or in their number of channels."""
    if image.shape != reference.shape:
        shown = [f"{s[1]}x{s[0]} {'RGB' if len(s) == 3 else 'grey'}" for s in (image.shape, reference.shape)]
        raise LabError(f"{name} has {shown[0]} pixels and its reference {shown[1]}: they must agree")


def check_finite(name: str, picture: Array, region: Region | None = None) -> None:
    """Raises AssertionError where `picture`, cut from `region`, holds NaN or infinity."""
    __tracebackhide__ = True
    wrong = ~np.isfinite(picture).reshape(*picture.shape[:2], -1).all(axis=2)
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        x, y = (0, 0) if region is None else region[:2]
        raise AssertionError(
            f"{name}: {wrong.sum()} of {wrong.size} pixels are not finite; "
            f"the first is at x={column + x} y={row + y}: {picture[row, column]}"
        )


def worst_block(pair: Pair, error: Array, across: int = 8) -> tuple[str, float]:
    """Where the picture, dealt to at most `across` blocks a side, differs most: in words, and the mean error there.

    `error` is (H, W) or (H, W, 3); errors of both signs in one block take each other away.
    """
    errors = error.reshape(*error.shape[:2], -1).mean(axis=2)
    rows, columns = (np.array_split(np.arange(side), min(across, side)) for side in errors.shape)
    blocks = [np.ix_(row, column) for row in rows for column in columns]
    worst = max(blocks, key=lambda block: abs(float(errors[block].sum())))
    y, x = (int(side.min()) + start for side, start in zip(worst, reversed(pair.corner), strict=True))
    height, width = errors[worst].shape
    means = versus(float(pair.image[worst].mean()), float(pair.reference[worst].mean()))
    return f"x={x}..{x + width - 1} y={y}..{y + height - 1}: {means}", float(errors[worst].mean())


def versus(image: float, reference: float) -> str:
    """``0.31, reference 0.45 (-31 %)``."""
    change = f" ({100 * (image / reference - 1):+.3g} %)" if reference else ""
    return f"{image:.4g}, reference {reference:.4g}{change}"
