"""A Vulkan device as a benchmark sees it: its ray tracing pipeline, a light kernel, and its memory."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from lab.bench import limits
from lab.bench.limits import Work
from lab.bench.traffic import traffic
from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.limit_light import LightLimit
from lab.engine.vulkan.limits import StreamLimit, gbuffer_rays, shadow_rays, vpl_rays
from lab.records import Frame

_CARD_STREAM = 4
"""Times the bytes that a processor streams: a card has larger caches, and is faster."""

_TILES, _GROUPS = 1024, 16384
_SOFTWARE_TILES, _SOFTWARE_GROUPS = 32, 32
"""Tiles whose lists the light kernel runs through, and workgroups that fill the device."""


class VulkanLimits:
    """See :class:`~lab.bench.limits.Limits`."""

    def __init__(self, machine: VulkanMachine, frame: Frame) -> None:
        self._machine, self.frame = machine, frame
        engine, software = machine.engine, machine.engine.gpu.software
        counted = engine.light(frame.hierarchy, frame.gbuffer, frame.params, counts=True)
        used = int(counted.counts()[1].sum(dtype=np.int64))
        self._rays = {
            "trace_vpls": vpl_rays(engine, frame),
            "render_gbuffer": gbuffer_rays(engine, frame),
            "trace_shadow_rays": shadow_rays(engine, frame),
        }
        # Not that of `counted`: where lights are counted, fewer are culled.
        visited = frame.lighting.visited
        self.work = Work(used, visited, {stage: len(rays) for stage, rays in self._rays.items()}, traffic(frame))
        self._light = LightLimit(
            engine,
            frame,
            tiles=_SOFTWARE_TILES if software else _TILES,
            groups=_SOFTWARE_GROUPS if software else _GROUPS,
        )

    def rays_ms(self, stage: str) -> dict[str, float]:
        """The ray tracing pipeline's, with rays from a buffer."""
        return {stage: 1e3 * self._rays[stage].seconds()}

    def light_ms(self) -> dict[str, float]:
        """The plain kernel's."""
        rate = self._light.rate()
        return {"light": 1e3 * self.work.pairs_used / rate if rate > 0 else 0.0}

    def stream_ms(self) -> dict[str, float]:
        """Of the device's own memory."""
        return limits.stream_ms(self.work, self._machine.stream_rate())


class VulkanMachine:
    """See :class:`~lab.bench.limits.Machine`."""

    def __init__(self, engine: VulkanEngine) -> None:
        self.engine = engine

    def limits(self, frame: Frame) -> VulkanLimits:
        """Those of the stages of `frame`."""
        return VulkanLimits(self, frame)

    def stream_rate(self) -> float:
        """All threads', by the device's clock."""
        return self._stream.rate(limits.STREAM_PASSES)

    def device(self) -> dict[str, Any]:
        """Its name and driver."""
        return self.engine.gpu.describe()

    @cached_property
    def _stream(self) -> StreamLimit:
        gpu = self.engine.gpu
        return StreamLimit(gpu, limits.STREAM_BYTES * (1 if gpu.software else _CARD_STREAM))
