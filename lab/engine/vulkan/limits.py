"""What the device could do at best with the work of a stage: for ``lab bench``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.lighting import lighting_parts
from lab.engine.vulkan.program import RayShaders
from lab.engine.vulkan.render_gbuffer import camera_uniform
from lab.engine.vulkan.shadows import shadow_parts
from lab.engine.vulkan.uniforms import params_uniform
from lab.records import Frame

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu
    from lab.engine.vulkan.engine import VulkanEngine

_STREAM_RUN = 65536  # bytes that a workgroup of limit_stream.slang reads
_STREAM_THREADS = 256

_SURFACE = ("surface", "nearest", "hole")
_NEAREST = RayShaders("find_nearest", ("miss",), (_SURFACE,), payload_bytes=16)
_ANY = RayShaders("find_any", ("miss_in_sight",), (("surface", "", "hole_in_sight"),), payload_bytes=4)
_PATHS = RayShaders("follow", ("miss",), (_SURFACE,), payload_bytes=16)


def seconds(gpu: Gpu, record: Callable[[spy.CommandEncoder], object]) -> float:
    """What the device takes for what `record` hands to it."""
    with gpu.stage("limit") as encoder:
        record(encoder)
    return gpu.spans["limit"].ms / 1e3


class StreamLimit:
    """How fast the device reads memory."""

    def __init__(self, gpu: Gpu, size: int) -> None:
        """`size`: bytes that are read at a time, many times what caches hold."""
        self._gpu, groups = gpu, max(1, size // _STREAM_RUN)
        self.bytes = groups * _STREAM_RUN
        self._threads = [groups * _STREAM_THREADS, 1, 1]
        self._values = gpu.pool.take(self.bytes // 16, "4u4", "streamed")
        self._sums = gpu.pool.take(groups * _STREAM_THREADS, "u4", "sums of what was streamed")
        fill = gpu.program("limit_stream", "fill")
        seconds(gpu, lambda encoder: fill.dispatch(encoder, self._threads, values=self._values))
        seconds(gpu, self._read)
        if (total := self.read_back()) != self.bytes // 4:
            raise RuntimeError(f"of {self.bytes:,} bytes the device has read {4 * total:,}: it can't address them all")

    def rate(self, passes: int) -> float:
        """Bytes a second, the best of some passes."""
        return self.bytes / min(seconds(self._gpu, self._read) for _ in range(passes))

    def read_back(self) -> int:
        """The sum of all numbers that were read last: each is 1."""
        return int(self._sums.numpy().sum(dtype=np.uint64))

    def _read(self, encoder: spy.CommandEncoder) -> None:
        program = self._gpu.program("limit_stream", "read")
        program.dispatch(encoder, self._threads, values=self._values, sums=self._sums)


@dataclass(frozen=True)
class Rays:
    """Rays on the device.

    Attributes:
        origins: 4f4, and the length.    directions: 4f4; zero in rows of no ray.    count: how many rays there are.
        row: of the dispatch: a picture's width, so that neighbours are traced together as they are in the stage.
        nearest: whether the nearest hit is asked for; else only whether there is one.

    """

    engine: VulkanEngine
    origins: DeviceBuffer
    directions: DeviceBuffer
    count: int
    row: int
    nearest: bool

    def __len__(self) -> int:
        return self.count

    def seconds(self) -> float:
        """What the device takes to trace them."""
        return seconds(self.engine.gpu, self.record) if len(self) else 0.0

    def record(self, encoder: spy.CommandEncoder) -> DeviceBuffer:
        """Traces them; u4 a row: the number of the triangle that is hit, or whether the ray is free."""
        gpu, slots = self.engine.gpu, len(self.origins)
        found = gpu.pool.take(slots, "u4", "what rays found")
        gpu.ray_program("limit_rays", _NEAREST if self.nearest else _ANY).dispatch(
            encoder,
            [self.row, slots // self.row, 1],
            scene=self.engine.device_scene.uniform,
            origins=self.origins,
            directions=self.directions,
            found=found,
        )
        return found


def vpl_rays(engine: VulkanEngine, frame: Frame) -> Rays:
    """The rays of the light paths that the frame's lights come from; a list of lights comes from none."""
    gpu, sources = engine.gpu, engine.device_lights.sources
    paths, bounces = frame.lights.paths_launched, frame.params.max_bounces

    def record(encoder: spy.CommandEncoder, room: dict[str, DeviceBuffer]) -> None:
        gpu.ray_program("limit_vpl_rays", _PATHS).dispatch(
            encoder,
            [paths, 1, 1],
            scene=engine.device_scene.uniform,
            lights=engine.device_lights.uniform,
            sources=sources,
            source_count=len(sources),
            paths=paths,
            max_bounces=bounces,
            seed=frame.params.seed,
            **room,
        )

    made, there = _collect(engine, paths * bounces, record)
    # Those of paths that ended early are left out: they would only keep others waiting.
    origins, directions = (
        gpu.pool.upload(made[name].numpy()[there], f"ray {name}") for name in ("origins", "directions")
    )
    return Rays(engine, origins, directions, len(origins), row=max(1, len(origins)), nearest=True)


def gbuffer_rays(engine: VulkanEngine, frame: Frame) -> Rays:
    """One through each pixel's centre."""
    width, height = size = frame.gbuffer.size

    def record(encoder: spy.CommandEncoder, room: dict[str, DeviceBuffer]) -> None:
        camera = camera_uniform(frame.camera, size)
        program = engine.gpu.program("limit_frame_rays", "gbuffer_rays")
        program.dispatch(encoder, [width * height, 1, 1], camera=camera, size=size, **room)

    made, there = _collect(engine, width * height, record)
    return Rays(engine, **made, count=int(there.sum()), row=width, nearest=True)


def shadow_rays(engine: VulkanEngine, frame: Frame) -> Rays:
    """Those of the shadow samples, and of direct light."""
    gpu, params, lights = engine.gpu, frame.params, engine.device_lights.uniform
    view, shadows = gbuffer_parts(gpu, frame.gbuffer), shadow_parts(gpu, frame.shadows)
    suns, points, spots, emitters = lights["count"]
    a_pixel = params.shadow_samples + suns + points + spots + (params.direct_samples if emitters else 0)

    def record(encoder: spy.CommandEncoder, room: dict[str, DeviceBuffer]) -> None:
        gpu.program("limit_frame_rays", "shadow_rays").dispatch(
            encoder,
            [view.pixels, 1, 1],
            scene=engine.device_scene.uniform,
            lights=lights,
            picked_light=lighting_parts(gpu, frame.lighting).light,
            point=shadows.point,
            omega=shadows.omega,
            pixels=view.pixels,
            params=params_uniform(params),
            **{name: getattr(view, name) for name in ("position", "normal", "geometric_normal")},
            **room,
        )

    made, there = _collect(engine, view.pixels * a_pixel, record)
    return Rays(engine, **made, count=int(there.sum()), row=view.width, nearest=False)


def _collect(
    engine: VulkanEngine, most: int, record: Callable[[spy.CommandEncoder, dict[str, DeviceBuffer]], None]
) -> tuple[dict[str, DeviceBuffer], NDArray[np.bool_]]:
    """What `record` writes into ``origins`` and ``directions`` of `most` rows, and which of them are rays."""
    gpu = engine.gpu
    made = {name: gpu.pool.take(most, "4f4", f"ray {name}") for name in ("origins", "directions")}
    if most:
        with gpu.stage("limit") as encoder:
            for buffer in made.values():
                encoder.clear_buffer(buffer.raw)
            record(encoder, made)
    there = np.asarray(made["directions"].numpy()[:, :3].any(axis=1))
    return made, there
