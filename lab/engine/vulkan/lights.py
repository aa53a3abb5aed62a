"""Input lights on the device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.layouts import INPUT_LIGHT
from lab.engine.vulkan.records import device_record, parts
from lab.records import Lights

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu


@dataclass(frozen=True)
class LightsParts:
    """`lights`: rows of ``InputLight``, all of them used."""

    lights: DeviceBuffer


def lights_parts(gpu: Gpu, lights: Lights) -> LightsParts:
    """The device's buffers of any lights; those of the host are uploaded."""
    own = parts(lights)
    if isinstance(own, LightsParts):
        return own
    rows = np.zeros(len(lights), INPUT_LIGHT)
    for name in ("position", "flux", "normal"):
        rows[name] = getattr(lights, name)
    return LightsParts(gpu.pool.upload(rows, "input lights"))


def device_lights(made: LightsParts, paths_launched: int | Callable[[], int]) -> Lights:
    """The record of lights that a shader made; `paths_launched`: their number, or what reads it back."""

    def column(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
        return np.ascontiguousarray(made.lights.numpy()[name])

    return device_record(
        Lights,
        made,
        {
            "position": lambda: column("position"),
            "flux": lambda: column("flux"),
            "normal": lambda: column("normal"),
            "paths_launched": paths_launched if callable(paths_launched) else lambda: paths_launched,
        },
    )
