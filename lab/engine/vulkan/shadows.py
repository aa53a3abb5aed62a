"""Shadow samples, as traced and as filtered, on the device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import plane_of, rgb_of, upload_rgb
from lab.engine.vulkan.records import device_record, parts
from lab.records import FilteredShadows, ShadowSamples

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu


@dataclass(frozen=True)
class SignalParts:
    """What the filter reads and writes, pixel after pixel.

    Attributes:
        width, height, channels: pixels, and numbers a pixel of `shadowed` and `weight`: 1, or 3 for ``ratio_rgb``.
        shadowed, weight: f4, S and what it is relative to.
        area: 4f4, irradiance from emissive triangles; the fourth number is unused.
        left_out: 4f4, irradiance that the falloff leaves out; None without compensation.

    """

    width: int
    height: int
    channels: int
    shadowed: DeviceBuffer
    weight: DeviceBuffer
    area: DeviceBuffer
    left_out: DeviceBuffer | None = None


@dataclass(frozen=True)
class ShadowParts:
    """The buffers of stage trace_shadow_rays, pixel after pixel.

    Attributes:
        signal: S, its weight, and the noisy irradiances.
        direct: 4f4, irradiance from sun, point and spot lights; the fourth number is unused.
        point, member, omega, visible: 4f4, i4, f4, u4: of each sample.

    """

    signal: SignalParts
    direct: DeviceBuffer
    samples: int
    point: DeviceBuffer | None = None
    member: DeviceBuffer | None = None
    omega: DeviceBuffer | None = None
    visible: DeviceBuffer | None = None


def signal_parts(gpu: Gpu, shadows: ShadowSamples | FilteredShadows) -> SignalParts:
    """The device's buffers of the signals of any shadows, filtered or not; those of the host are uploaded."""
    own = parts(shadows)
    if isinstance(own, ShadowParts):
        return own.signal
    if isinstance(own, SignalParts):
        return own
    height, width, channels = shadows.shadowed.shape
    return SignalParts(
        width,
        height,
        channels,
        gpu.pool.upload(shadows.shadowed.reshape(-1), "shadowed"),
        gpu.pool.upload(shadows.weight.reshape(-1), "shadow weight"),
        upload_rgb(gpu, shadows.area, "area light"),
        None if shadows.left_out is None else upload_rgb(gpu, shadows.left_out, "left out"),
    )


def shadow_parts(gpu: Gpu, shadows: ShadowSamples) -> ShadowParts:
    """The device's buffers of any traced shadows, without the single samples where they are the host's."""
    own = parts(shadows)
    if isinstance(own, ShadowParts):
        return own
    samples = shadows.omega.shape[2]
    return ShadowParts(signal_parts(gpu, shadows), upload_rgb(gpu, shadows.direct, "direct light"), samples)


def device_filtered(made: SignalParts) -> FilteredShadows:
    """The record of filtered shadows that shaders made."""
    return device_record(FilteredShadows, made, _signal_fields(made))


def device_shadows(made: ShadowParts) -> ShadowSamples:
    """The record of shadow samples that shaders made; the single samples must be there."""
    if made.point is None or made.member is None or made.omega is None or made.visible is None:
        raise ValueError("shadow samples without their points, members, omegas and visibilities are no record")
    height, width, samples = made.signal.height, made.signal.width, made.samples
    point, visible = made.point, made.visible
    fields: dict[str, Callable[[], object]] = {
        **_signal_fields(made.signal),
        "point": lambda: np.ascontiguousarray(point.numpy()[:, :3].reshape(height, width, samples, 3)),
        "member": plane_of(made.member, height, width, samples),
        "omega": plane_of(made.omega, height, width, samples),
        "visible": lambda: visible.numpy().reshape(height, width, samples).astype(np.uint8),
        "direct": rgb_of(made.direct, (height, width)),
    }
    return device_record(ShadowSamples, made, fields)


def _signal_fields(made: SignalParts) -> dict[str, Callable[[], object]]:
    shape = made.height, made.width
    left_out = made.left_out
    return {
        "shadowed": plane_of(made.shadowed, *shape, made.channels),
        "weight": plane_of(made.weight, *shape, made.channels),
        "area": rgb_of(made.area, shape),
        "left_out": (lambda: None) if left_out is None else rgb_of(left_out, shape),
    }
