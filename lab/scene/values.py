"""Numbers, vectors and words that come from a file: checked one by one, with the place they stand named."""

from __future__ import annotations

import math
from typing import TypeGuard

import numpy as np

from lab.errors import LabError
from lab.scene.scene import Vec3


def shown(value: object) -> str:
    """`value` as a message shows it: short, on one line."""
    words = " ".join(repr(value).split())
    return words if len(words) <= 60 else words[:57] + "..."


def is_number(value: object) -> TypeGuard[int | float]:
    """True for a finite int or float; booleans are not numbers."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an int beyond float's range
        return False


def number(
    where: str, value: object, low: float = -math.inf, high: float = math.inf, *, open_low: bool = False
) -> float:
    """`value` as a float from `low` to `high` (over `low` if `open_low`), or :class:`LabError` naming `where`."""
    if is_number(value) and low <= value <= high and not (open_low and value == low):
        return float(value)
    least = f" {'over' if open_low else 'from'} {low:g}" if math.isfinite(low) else ""
    most = f" up to {high:g}" if math.isfinite(high) else ""
    raise LabError(f"{where} is {shown(value)}: it must be a finite number{least}{most}")


def vector(where: str, value: object, low: float = -math.inf, high: float = math.inf) -> Vec3:
    """`value` as three finite numbers from `low` to `high`, or :class:`LabError` naming `where`."""
    if isinstance(value, list | tuple) and len(value) == 3 and all(is_number(v) and low <= v <= high for v in value):
        return (float(value[0]), float(value[1]), float(value[2]))
    least = f" from {low:g}" if math.isfinite(low) else ""
    most = f" up to {high:g}" if math.isfinite(high) else ""
    raise LabError(f"{where} is {shown(value)}: it must be three finite numbers{least}{most}, as [1, 2, 3]")


def direction(where: str, value: object) -> Vec3:
    """`value` as a unit vector; any length over zero is taken."""
    x, y, z = vector(where, value)
    largest = max(abs(x), abs(y), abs(z))
    if largest == 0:
        raise LabError(f"{where} is [0, 0, 0]: a direction needs a length")
    scaled = np.array([x, y, z]) / largest  # so that no square overflows or vanishes
    unit = scaled / np.linalg.norm(scaled)
    return (float(unit[0]), float(unit[1]), float(unit[2]))


def word(where: str, value: object) -> str:
    """`value` as a non-empty text, or :class:`LabError` naming `where`."""
    if isinstance(value, str) and value:
        return value
    raise LabError(f'{where} is {shown(value)}: it must be a text in quotes, as "name"')


def flag(where: str, value: object) -> bool:
    """`value` as true or false, or :class:`LabError` naming `where`."""
    if isinstance(value, bool):
        return value
    raise LabError(f"{where} is {shown(value)}: it must be true or false")
