"""From values to places on a colour map: the ends, and whether steps are even or ratios."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gui.layers.colour_maps import table
from lab.error_picture import round_up
from lab.errors import LabError
from lab.layers import COUNT, SCALAR, SIGNED, Layer


@dataclass(frozen=True)
class Scale:
    """Where values stand on a colour map.

    Attributes:
        low, high: values of its ends; what lies beyond takes the end's colour, and the legend says so.
        colour_map: its name.    log: equal steps are equal ratios.
        beyond_low, beyond_high: whether any value lies beyond that end.
    """

    low: float
    high: float
    colour_map: str = "heat"
    log: bool = False
    beyond_low: bool = False
    beyond_high: bool = False

    def __post_init__(self) -> None:
        table(self.colour_map)
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low < self.high):
            raise LabError(f"scale from {self.low:g} to {self.high:g}: its low end must lie under its high end")
        if self.log and self.low <= 0:
            raise LabError(f"scale from {self.low:g}: a logarithmic one must begin over 0")

    def place(self, values: NDArray[Any]) -> NDArray[np.float32]:
        """Places of `values`, 0 at the low end and 1 at the high one."""
        v = np.asarray(values, np.float32)
        if self.log:
            floor = np.maximum(v, np.float32(self.low) * np.float32(1e-6))
            span = np.log(self.high / self.low)
            return np.asarray(np.log(floor / np.float32(self.low)) / np.float32(span), np.float32)
        return np.asarray((v - np.float32(self.low)) / np.float32(self.high - self.low), np.float32)

    def colours(self, values: NDArray[Any]) -> NDArray[np.uint8]:
        """(...) values as (..., 3) colours; what is no number takes the low end's."""
        colours = table(self.colour_map)
        last = len(colours) - 1
        steps = np.nan_to_num(self.place(values) * last, nan=0.0, posinf=last, neginf=0.0)
        return np.asarray(np.take(colours, np.clip(steps + 0.5, 0, last).astype(np.uint8), axis=0))


def scale_for(
    layer: Layer,
    values: NDArray[Any],
    seen: NDArray[np.bool_] | None = None,
    *,
    colour_map: str | None = None,
    low: float | None = None,
    high: float | None = None,
    log: bool = False,
) -> Scale:
    """The scale that shows a layer's (H, W) `values` at the pixels `seen`.

    Ends that are not given are the layer's usual ones, else those of the values: counts begin at 0, signed values
    reach as far below as above and leave the worst 1 % of pixels beyond; scalars that begin at 0 and end anywhere
    leave 0.2 %.
    """
    chosen = values if seen is None else values[seen]
    known = chosen[np.isfinite(chosen)] if np.issubdtype(values.dtype, np.floating) else chosen
    least, greatest = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    if layer.kind == SIGNED:
        reach = round_up(float(np.quantile(np.abs(known), 0.99))) if known.size else 1.0
        first, last = -reach, reach
    else:
        first = layer.low if layer.low is not None else least
        last = layer.high if layer.high is not None else greatest
        if layer.kind == SCALAR and layer.low == 0 and layer.high is None and known.size:
            last = float(np.quantile(known, 0.998))
        if log and first <= 0:
            positive = known[known > 0]
            first = float(positive.min()) if positive.size else 1.0
            last = max(last, first)
    first, last = (first if low is None else low), (last if high is None else high)
    if high is None and last <= first:
        last = first + max(1.0 if layer.kind == COUNT else 0.0, abs(first)) if first else 1.0
    if low is None and first >= last:
        first = last - max(abs(last), 1.0)
    name = colour_map or layer.colour_map
    return Scale(first, last, name, log, least < first, greatest > last)
