"""A pixel's value as text, for the line under the pointer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gui.layers.frame_layers import FrameLayers
from lab.colour import luminance
from lab.errors import LabError
from lab.layers import COUNT, LEVEL, LIGHT, SIGNED, TILE, Layer, find_layer
from lab.records import Frame


def value_text(layer: Layer, value: NDArray[Any]) -> str:
    """One pixel's value, () or (3,), with its unit."""
    unit = f" {layer.unit}" if layer.unit else ""
    if value.ndim:
        numbers = "  ".join(number_text(float(v)) for v in value)
        lightness = f", luminance {number_text(float(luminance(value)))}" if layer.kind == LIGHT else ""
        return f"({numbers}){unit}{lightness}"
    if not np.isfinite(value) or (layer.kind == LEVEL and value < 0):
        return "nothing picked" if layer.group in ("picks", "shadows") else "no number"
    said = {
        SIGNED: lambda: f"{100 * float(value):+.3g} %",
        COUNT: lambda: f"{int(value):,} {'light' if int(value) == 1 else 'lights'}",
        LEVEL: lambda: f"level {int(value)}",
        TILE: lambda: f"tile {int(value)}",
    }
    return said.get(layer.kind, lambda: f"{number_text(float(value))}{unit}")()


def number_text(value: float) -> str:
    """Four digits; very small and very large ones with a power of ten."""
    if not math.isfinite(value) or value == 0:
        return f"{value:g}"
    return f"{value:.4g}" if 1e-4 <= abs(value) < 1e5 else f"{value:.3e}"


def value_at(frame: Frame | FrameLayers, name: str, x: int, y: int) -> str:
    """What layer `name` has at pixel (x, y), with its unit."""
    layers = frame if isinstance(frame, FrameLayers) else FrameLayers(frame)
    width, height = layers.frame.gbuffer.size
    if not (0 <= x < width and 0 <= y < height):
        raise LabError(f"pixel ({x}, {y}) lies outside of the image: x from 0 to {width - 1}, y from 0 to {height - 1}")
    layer = find_layer(name)
    values = layers.values(name)
    if not layer.everywhere and layers.frame.gbuffer.depth[y, x] == 0:
        return "background"
    return value_text(layer, np.asarray(values[y, x]))
