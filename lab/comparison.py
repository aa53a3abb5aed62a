"""One layer of an EXR file against the same layer of another: read, checked, and measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError, nearest
from lab.image_io import read_exr
from lab.metrics import (
    PIXELS_PER_DEGREE,
    energy_ratio,
    flip,
    flip_exposures,
    floor_of,
    mse,
    rel_mse,
    rel_mse_noise,
)

Array = NDArray[np.float64]
Record = dict[str, Any]

DEFAULT_LAYER = "colour"

MOST_NEGATIVE = 0.01
"""A layer of which more than this share of values is below 0 is no light, and FLIP has nothing to say about it."""


@dataclass(frozen=True)
class Layer:
    """A layer of a file.

    Attributes:
        file: path as given.    name: of the layer, "" for the plain R G B of other programs.
        pixels: (H, W, 3) or (H, W), finite.
        variance: the variance of each value, same shape, where the file has a layer NAME_variance of finite numbers.

    """

    file: str
    name: str
    pixels: Array
    variance: Array | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.pixels.shape[1], self.pixels.shape[0]

    @property
    def components(self) -> str:
        """The name of each channel, one letter each."""
        if self.pixels.ndim == 2:
            return "Y"
        return "XYZ" if self.name in ("normal", "position") else "RGB"

    def __str__(self) -> str:
        return f"{self.file}, layer {_called(self.name)}"


@dataclass(frozen=True)
class Region:
    """A rectangle of pixels, x to the right and y down from the upper left corner."""

    x: int
    y: int
    width: int
    height: int

    def of(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """The part of (H, W, ...) pixels in the region."""
        return pixels[self.y : self.y + self.height, self.x : self.x + self.width]


def read_region(text: str) -> Region:
    """``x,y,width,height`` in whole pixels."""
    parts = text.split(",")
    if len(parts) != 4 or not all(part.strip().isdecimal() and len(part) <= 9 for part in parts):
        raise LabError(f"--region {text}: expected x,y,width,height in whole pixels, for example --region 10,20,64,64")
    region = Region(*(int(part) for part in parts))
    if not (region.width and region.height):
        raise LabError(f"--region {text}: has no pixels; width and height must be 1 or more")
    return region


def read_layers(path_a: str, path_b: str, name: str | None) -> tuple[Layer, Layer]:
    """The layer `name` of two EXR files, which must be alike in size and channels.

    Without a name it is ``colour``, or the plain R G B channels of a file that another program wrote.
    """
    a, b = read_layer(path_a, name), read_layer(path_b, name)
    if a.size != b.size:
        sizes = [f"{layer.file} is {layer.size[0]}x{layer.size[1]}" for layer in (a, b)]
        raise LabError(f"{sizes[0]} and {sizes[1]} pixels; only images of one size can be compared")
    if a.components != b.components:
        raise LabError(
            f"{a} has the channels {' '.join(a.components)}, but {b} {' '.join(b.components)}; give a layer of one kind"
        )
    return a, b


def read_layer(path: str, name: str | None) -> Layer:
    """One layer of an EXR file, as :func:`read_layers` takes it."""
    layers: dict[str, NDArray[Any]] = dict(read_exr(path))
    if all(c in layers for c in "RGB") and len({layers[c].shape for c in "RGB"}) == 1:
        layers[""] = np.stack([layers.pop(c) for c in "RGB"], axis=-1)
    if name is None:
        name = DEFAULT_LAYER if DEFAULT_LAYER in layers or "" not in layers else ""
    if name not in layers:
        there = ", ".join(_called(layer) for layer in sorted(layers))
        raise LabError(f"{path}: has no layer {_called(name)}; it has {there}{nearest(name, layers)}")
    pixels = _numbers(path, name, layers[name])
    wrong = ~np.isfinite(pixels)
    if wrong.any():
        raise LabError(_what_is_wrong(path, name, pixels, wrong))
    variance = layers.get(f"{name or DEFAULT_LAYER}_variance")
    if variance is None or variance.shape != pixels.shape:
        return Layer(path, name, pixels)
    noise = _numbers(path, f"{name}_variance", variance)
    return Layer(path, name, pixels, noise if np.isfinite(noise).all() and (noise >= 0).all() else None)


def measure(a: Layer, b: Layer, regions: Sequence[Region] = (), per_channel: bool = False) -> Record:
    """Every number of a comparison, ready for JSON; what has no value is None, and ``notes`` say why.

    One epsilon, of the whole layer, serves channels and regions too, so that the relMSE of the parts average to that
    of the whole. FLIP of a region is the mean of the whole image's map there. ``flip_map`` is the (H, W) map or None.
    """
    width, height = a.size
    for region in regions:
        if region.x + region.width > width or region.y + region.height > height:
            given = f"{region.x},{region.y},{region.width},{region.height}"
            raise LabError(f"--region {given}: reaches outside of the image, which has {width}x{height} pixels")
    epsilon = floor_of(b.pixels)
    notes: list[str] = []
    record: Record = {
        "a": {"file": a.file, "layer": a.name},
        "b": {"file": b.file, "layer": b.name},
        "layer": a.name,
        "size": [width, height],
        "channels": list(a.components),
        "epsilon": epsilon,
    }
    error_map = _flip(a, b, record, notes)
    pair = _Pair(a, b, epsilon, error_map, per_channel)
    record |= pair.values(Region(0, 0, width, height))
    parts = [pair.values(region) for region in regions]
    if regions:
        record["regions"] = [
            {"region": [region.x, region.y, region.width, region.height]} | part
            for region, part in zip(regions, parts, strict=True)
        ]
    rows = [row for part in (record, *parts) for row in (part, *part.get("per_channel", {}).values())]
    if any(row["energy_ratio"] is None for row in rows):
        notes.append(
            "energy_ratio has no value where B sums to 0 or less, nor has rel_mse where B is black and A is not"
        )
    if Path(a.file).samefile(b.file):
        notes.append("A and B are one file")
    if b.variance is not None:
        notes.append(
            "rel_mse_noise is the part of rel_mse that the noise of B brings: A without any error would have it"
        )
    return record | {"notes": notes, "flip_map": error_map}


@dataclass(frozen=True)
class _Pair:
    """What the numbers of every region are made of."""

    a: Layer
    b: Layer
    epsilon: float
    error_map: NDArray[np.float32] | None
    per_channel: bool

    def values(self, region: Region) -> Record:
        x, y = region.of(self.a.pixels), region.of(self.b.pixels)
        values = _metrics(x, y, self.epsilon)
        for name, layer in (("rel_mse_noise", self.b), ("rel_mse_noise_a", self.a)):
            if layer.variance is not None:
                values[name] = _number(rel_mse_noise(y, region.of(layer.variance), epsilon=self.epsilon))
        seen = None if self.error_map is None else region.of(self.error_map)
        values["flip"] = None if seen is None else float(seen.mean(dtype=np.float64))
        if self.per_channel and x.ndim == 3:
            channels = enumerate(self.a.components)
            values["per_channel"] = {name: _metrics(x[..., i], y[..., i], self.epsilon) for i, name in channels}
        return values


def _metrics(a: Array, b: Array, epsilon: float) -> Record:
    squared = mse(a, b)
    return {
        "rel_mse": _number(rel_mse(a, b, epsilon=epsilon)) if epsilon > 0 or squared == 0 else None,
        "mse": _number(squared),
        "rmse": _number(math.sqrt(squared)),
        "energy_ratio": _number(energy_ratio(a, b)) if b.sum() > 0 else None,
    }


def _flip(a: Layer, b: Layer, record: Record, notes: list[str]) -> NDArray[np.float32] | None:
    """The FLIP map; adds its settings to `record`, or to `notes` why there is none."""
    if a.components != "RGB":
        notes.append("flip has no value: it compares RGB light as seen on a screen, and this layer is none")
        return None
    below = max(float(np.mean(layer.pixels < 0)) for layer in (a, b))
    if below > MOST_NEGATIVE:
        notes.append(f"flip has no value: {below:.0%} of the values are below 0, so this layer is no light")
        return None
    if below > 0:
        notes.append(f"flip takes the values below 0 ({below:.2g} of all) as black")
    _, error_map = flip(a.pixels, b.pixels)
    exposures = flip_exposures(np.maximum(b.pixels, 0)) or flip_exposures(np.maximum(a.pixels, 0))
    record["flip_settings"] = {
        "pixels_per_degree": PIXELS_PER_DEGREE,
        "exposures": None if exposures is None else exposures._asdict(),
    }
    return error_map


def _number(value: float) -> float | None:
    """Strict JSON knows no infinity."""
    return value if math.isfinite(value) else None


def _numbers(path: str, name: str, pixels: NDArray[Any]) -> Array:
    if pixels.ndim not in (2, 3) or not np.issubdtype(pixels.dtype, np.number) or pixels.size == 0:
        raise LabError(f"{path}: layer {_called(name)} is no image of numbers; give a flat, not a deep, EXR")
    return pixels.astype(np.float64)


def _what_is_wrong(path: str, name: str, pixels: Array, wrong: NDArray[np.bool_]) -> str:
    y, x, *_ = (int(i) for i in np.argwhere(wrong)[0])
    count = int(wrong.reshape(*wrong.shape[:2], -1).any(axis=-1).sum())
    value = np.atleast_1d(pixels[y, x])[np.atleast_1d(wrong[y, x])][0]
    many = f"{count} pixels of layer {_called(name)} are" if count > 1 else f"a pixel of layer {_called(name)} is"
    return f"{path}: {many} not finite, the first at x={x}, y={y} ({value}); no metric has a meaning then"


def _called(layer: str) -> str:
    return repr(layer) if layer else "'' (plain R G B)"
