"""Unshadowed light and the picked shadow samples, on the device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import GBufferParts, plane_of, rgb_of, upload_rgb
from lab.engine.vulkan.hierarchy import HierarchyParts
from lab.engine.vulkan.records import device_record, parts
from lab.records import Lighting

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu


@dataclass(frozen=True)
class LightingParts:
    """The buffers of stage light, pixel after pixel.

    Attributes:
        width, height, samples: pixels, and shadow samples a pixel.
        irradiance: 4f4: RGB, and F, the sum that was picked from.
        light: i4, `samples` a pixel: merged index of each pick, -1 for none.    target_weight: f4, as many.
        overdraw, lights_used: u4, level after level; None where not counted.
        fragments: u4, that were rasterised; None where not counted.
        visited: u4, pairs of pixel and light that each tile evaluated; None where there are no tiles.
        lit_by: the hierarchy, where that is the device's: its levels are those of the counts, which have room for more.

    """

    width: int
    height: int
    samples: int
    irradiance: DeviceBuffer
    light: DeviceBuffer
    target_weight: DeviceBuffer
    overdraw: DeviceBuffer | None = None
    lights_used: DeviceBuffer | None = None
    fragments: DeviceBuffer | None = None
    visited: DeviceBuffer | None = None
    lit_by: HierarchyParts | None = None


def take_lighting(gpu: Gpu, lights: HierarchyParts, view: GBufferParts, samples: int, counts: bool) -> LightingParts:
    """Buffers for shaders to fill; those of the counts are bound in any case, and a single row without `counts`."""
    pool, counted = gpu.pool, lights.most_levels * view.pixels if counts else 1
    return LightingParts(
        view.width,
        view.height,
        samples,
        irradiance=pool.take(view.pixels, "4f4", "irradiance"),
        light=pool.take(view.pixels * samples, "i4", "picked lights"),
        target_weight=pool.take(view.pixels * samples, "f4", "target weights"),
        overdraw=pool.take(counted, "u4", "overdraw"),
        lights_used=pool.take(counted, "u4", "lights used"),
        lit_by=lights,
    )


def lighting_parts(gpu: Gpu, lighting: Lighting) -> LightingParts:
    """The device's buffers of any lighting, without its counts where it is the host's: no stage reads them."""
    own = parts(lighting)
    if isinstance(own, LightingParts):
        return own
    height, width, samples = lighting.light.shape
    pool = gpu.pool
    return LightingParts(
        width,
        height,
        samples,
        upload_rgb(gpu, lighting.irradiance, "irradiance", lighting.weight_sum),
        pool.upload(lighting.light.reshape(-1), "picked lights"),
        pool.upload(lighting.target_weight.reshape(-1), "target weights"),
    )


def device_lighting(made: LightingParts) -> Lighting:
    """The record of lighting that shaders made."""
    height, width, samples = made.height, made.width, made.samples

    def counts(of: DeviceBuffer | None) -> object:
        if of is None:
            return None
        rows = None if made.lit_by is None else made.lit_by.levels() * height * width
        return of.numpy(rows).reshape(-1, height, width)

    def fragments() -> object:
        return None if made.fragments is None else made.fragments.numpy().reshape(height, width)

    def visited() -> int:
        evaluated = made.fragments if made.visited is None else made.visited
        return 0 if evaluated is None else int(evaluated.numpy().sum(dtype=np.uint64))

    return device_record(
        Lighting,
        made,
        {
            "irradiance": rgb_of(made.irradiance, (height, width)),
            "overdraw": lambda: counts(made.overdraw),
            "lights_used": lambda: counts(made.lights_used),
            "light": plane_of(made.light, height, width, samples),
            "target_weight": plane_of(made.target_weight, height, width, samples),
            "weight_sum": lambda: np.ascontiguousarray(made.irradiance.numpy()[:, 3].reshape(height, width)),
            "visited": visited,
            "fragments": fragments,
        },
    )
