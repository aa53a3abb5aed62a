"""A layer drawn: values to the pixels that are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gui.layers.colour_maps import stripes
from gui.layers.frame_layers import FrameLayers
from gui.layers.read_out import value_at
from gui.layers.scale import Scale, scale_for
from gui.legend import Legend, legend, shown_exposure
from lab.colour import srgb_encode, to_bytes
from lab.errors import LabError
from lab.layers import (
    COLOUR,
    COUNT,
    DIRECTION,
    LEVEL,
    LIGHT,
    POSITION,
    SCALAR,
    SIGNED,
    TILE,
    Layer,
    find_layer,
)
from lab.level_colours import category_table
from lab.pixel_stats import PixelStats, pixel_stats

Pixels = NDArray[np.uint8]

_SCALED = (SCALAR, COUNT, SIGNED)


@dataclass(frozen=True)
class LayerPicture:
    """A layer as it is shown.

    Attributes:
        layer: what it is.    values: (H, W) or (H, W, 3), the record's.    pixels: (H, W, 3) sRGB bytes.
        legend: what the colours mean.    scale: None where there is none.    exposure: 1 but for light.
        stats: over the pixels that have a value; None for directions, positions and categories.
    """

    layers: FrameLayers
    layer: Layer
    values: NDArray[Any]
    pixels: Pixels
    legend: Legend
    scale: Scale | None
    exposure: float
    stats: PixelStats | None

    def value_at(self, x: int, y: int) -> str:
        """The value of pixel (x, y) with its unit."""
        return value_at(self.layers, self.layer.name, x, y)


def layer_picture(
    layers: FrameLayers,
    name: str,
    *,
    exposure: float = 1.0,
    colour_map: str | None = None,
    low: float | None = None,
    high: float | None = None,
    log: bool = False,
) -> LayerPicture:
    """Layer `name` drawn, with legend and statistics; `exposure` counts for light, the others where there is a scale.

    Errors: :class:`LabError` for a layer that the frame does not have and for a scale that can't be.
    """
    layer, values = find_layer(name), layers.values(name)
    seen = None if layer.everywhere else layers.seen
    scale = None
    if layer.kind in _SCALED:
        scale = scale_for(layer, values, seen, colour_map=colour_map, low=low, high=high, log=log)
    pixels = draw(values, layer.kind, scale, seen, shown_exposure(layer, exposure))
    bounds = (scale.low, scale.high) if scale is not None and not scale.log else (None, None)
    stats = None
    if layer.kind in (*_SCALED, LIGHT, COLOUR):
        stats = pixel_stats(values, seen, low=bounds[0], high=bounds[1])
    bar = legend(layer, values, scale=scale, exposure=exposure, seen=seen)
    return LayerPicture(layers, layer, values, pixels, bar, scale, exposure, stats)


def draw_layer(
    values: NDArray[Any],
    kind: str,
    *,
    exposure: float = 1.0,
    colour_map: str | None = None,
    low: float | None = None,
    high: float | None = None,
    log: bool = False,
    seen: NDArray[np.bool_] | None = None,
) -> Pixels:
    """Any (H, W) or (H, W, 3) values of a `kind` of :mod:`lab.layers` as (H, W, 3) sRGB bytes.

    Pixels that are not `seen` (H, W), and those whose value is no number, are grey stripes.
    """
    scale = None
    if kind in _SCALED:
        usual = Layer(
            "", "", "", kind, colour_map="signed" if kind == SIGNED else "heat", low=0 if kind == COUNT else None
        )
        scale = scale_for(usual, values, seen, colour_map=colour_map, low=low, high=high, log=log)
    return draw(values, kind, scale, seen, exposure)


def draw(
    values: NDArray[Any], kind: str, scale: Scale | None, seen: NDArray[np.bool_] | None, exposure: float
) -> Pixels:
    """Values on their `scale`, for a kind that has one, else by the kind alone."""
    wanted = 2 if kind in (*_SCALED, LEVEL, TILE) else 3
    if values.ndim != wanted or (wanted == 3 and values.shape[2] != 3):
        raise LabError(f"a picture of {kind} takes (H, W{', 3' if wanted == 3 else ''}) values, got {values.shape}")
    known = np.isfinite(values) if np.issubdtype(values.dtype, np.floating) else np.ones(values.shape, bool)
    if kind == LIGHT:
        pixels = to_bytes(values, exposure)
    elif kind == COLOUR:
        pixels = np.rint(srgb_encode(values) * 255).astype(np.uint8)
    elif kind == DIRECTION:
        pixels = _bytes(values * np.float32(0.5) + np.float32(0.5))
    elif kind == POSITION:
        low, high = position_range(values, seen)
        pixels = _bytes((values - low) / np.maximum(high - low, np.float32(1e-30)))
    elif kind in (LEVEL, TILE):
        colours = category_table(kind)
        pixels = colours[values % len(colours)]
        known = values >= 0
    elif scale is not None:
        pixels = scale.colours(values)
    else:
        raise LabError(f"unknown kind of layer: {kind!r}")
    shown = np.asarray(known.all(axis=-1) if known.ndim == 3 else known)
    if seen is not None:
        shown = shown & seen
    if not shown.all():
        pixels = np.where(shown[..., None], pixels, stripes(*values.shape[:2]))
    return pixels


def position_range(
    values: NDArray[Any], seen: NDArray[np.bool_] | None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Least and greatest of each axis, (3,), over the pixels `seen`."""
    chosen = values.reshape(-1, 3) if seen is None else values[seen]
    if len(chosen) == 0:
        return np.zeros(3, np.float32), np.ones(3, np.float32)
    return np.asarray(chosen.min(axis=0), np.float32), np.asarray(chosen.max(axis=0), np.float32)


def _bytes(share: NDArray[Any]) -> Pixels:
    return np.asarray(np.clip(np.nan_to_num(share), 0, 1) * 255 + 0.5).astype(np.uint8)
