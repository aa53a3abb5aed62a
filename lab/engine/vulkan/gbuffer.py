"""A G-buffer on the device."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.records import device_record, parts
from lab.records import Floats, GBuffer

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu


@dataclass(frozen=True)
class GBufferParts:
    """The buffers of a G-buffer, a row of four floats a pixel in each.

    Attributes:
        width, height: pixels.    pixel_angle: see :class:`~lab.records.GBuffer`.
        position: x y z, and the depth (0: nothing is hit).
        normal, geometric_normal, albedo, emission: three numbers; the fourth is unused.
        camera: the value of a shader's ``CameraRays``, and `reach`, which no point is farther from the eye than; None
            and 0 where only points are known.

    """

    width: int
    height: int
    pixel_angle: float
    position: DeviceBuffer
    normal: DeviceBuffer
    geometric_normal: DeviceBuffer
    albedo: DeviceBuffer
    emission: DeviceBuffer
    camera: Mapping[str, Any] | None = None
    reach: float = 0.0

    @property
    def pixels(self) -> int:
        """How many."""
        return self.width * self.height


def gbuffer_parts(gpu: Gpu, gbuffer: GBuffer) -> GBufferParts:
    """The device's buffers of any G-buffer; one of the host is uploaded."""
    own = parts(gbuffer)
    if isinstance(own, GBufferParts):
        return own
    return GBufferParts(
        *gbuffer.size,
        gbuffer.pixel_angle,
        position=upload_rgb(gpu, gbuffer.position, "position", gbuffer.depth),
        normal=upload_rgb(gpu, gbuffer.normal, "normal"),
        geometric_normal=upload_rgb(gpu, gbuffer.geometric_normal, "geometric normal"),
        albedo=upload_rgb(gpu, gbuffer.albedo, "albedo"),
        emission=upload_rgb(gpu, gbuffer.emission, "emission"),
    )


def device_gbuffer(made: GBufferParts) -> GBuffer:
    """The record of a G-buffer that shaders made."""
    shape = made.height, made.width
    names = ("position", "normal", "geometric_normal", "albedo", "emission")
    fields: dict[str, Callable[[], object]] = {name: rgb_of(getattr(made, name), shape) for name in names}
    fields["depth"] = lambda: np.ascontiguousarray(made.position.numpy()[:, 3].reshape(shape))
    fields["pixel_angle"] = lambda: made.pixel_angle
    return device_record(GBuffer, made, fields)


def upload_rgb(gpu: Gpu, values: Floats, label: str, fourth: Floats | None = None) -> DeviceBuffer:
    """A picture of three numbers a pixel, in rows of four; the last one is `fourth`, or 0."""
    rows = np.zeros((values.shape[0] * values.shape[1], 4), np.float32)
    rows[:, :3] = values.reshape(-1, 3)
    if fourth is not None:
        rows[:, 3] = fourth.reshape(-1)
    return gpu.pool.upload(rows, label)


def rgb_of(buffer: DeviceBuffer, shape: tuple[int, int]) -> Callable[[], Floats]:
    """What reads back the first three of four numbers a pixel: (H, W, 3)."""
    return lambda: np.ascontiguousarray(buffer.numpy()[:, :3].reshape(*shape, 3))


def plane_of(buffer: DeviceBuffer, *shape: int) -> Callable[[], np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    """What reads back a buffer of single numbers in some shape."""
    return lambda: buffer.numpy().reshape(shape)
