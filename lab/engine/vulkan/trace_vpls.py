"""Stage trace_vpls: light paths on the device, the same as the core's (core_cpp/src/trace_vpls.cpp)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.layouts import INPUT_LIGHT
from lab.engine.vulkan.lights import LightsParts, device_lights
from lab.engine.vulkan.program import RayShaders
from lab.engine.vulkan.scene import DeviceScene
from lab.engine.vulkan.scene_lights import DeviceLights
from lab.errors import LabError
from lab.params import Params
from lab.records import Lights

if TYPE_CHECKING:
    from collections.abc import Iterator

    import slangpy as spy

    from lab.engine.vulkan.device import Gpu

PROGRESS = np.dtype([("done", "u4"), ("launched", "u4")])

_SHADERS = RayShaders("follow", ("miss",), (("surface", "nearest", "hole"),), payload_bytes=16)
_GROUP = 256
_MOST_ROWS = 2**21
"""Lights that one round of paths may leave before they are put in order: 100 MB."""
_PATIENCE = 1_000_000


class VplTracer:
    """Traces the VPLs of one scene.

    How many lights a path leaves depends on the scene and the bounces. It is found out once, by looking after each
    round of paths. From then on so many paths are launched that they suffice (by eight standard deviations, about),
    what is too much is left out, and nothing is read back.
    """

    def __init__(self, gpu: Gpu, scene: DeviceScene, lights: DeviceLights) -> None:
        self._gpu, self._scene, self._lights = gpu, scene, lights
        self._lights_per_path: dict[int, float] = {}

    def trace(self, params: Params) -> Lights:
        """Exactly ``params.vpls`` lights.

        Errors: :class:`LabError` where light reaches (almost) nothing; it does not name the scene.
        """
        if len(self._lights.sources) == 0:
            raise LabError("the scene has no light with any power")
        lights = self._gpu.pool.take(params.vpls, INPUT_LIGHT, "input lights")
        progress = self._gpu.pool.take(1, PROGRESS, "VPL progress")
        rate = self._lights_per_path.get(params.max_bounces)
        if rate is None:
            launched = self._explore(params, lights, progress)
            self._lights_per_path[params.max_bounces] = params.vpls / launched
        else:
            with self._gpu.stage("trace_vpls") as encoder:
                encoder.clear_buffer(progress.raw)
                for paths in _rounds(range(_enough_paths(params.vpls, rate)), params.max_bounces):
                    self._round(encoder, params, paths, lights, progress)
                self._share_power(encoder, params, lights, progress)

        def paths_launched() -> int:
            found = int(progress.numpy()[0]["launched"])
            if found == 0:
                raise RuntimeError(f"seed {params.seed}: fewer than {params.vpls} lights were found, and none is lit")
            return found

        return device_lights(LightsParts(lights), paths_launched)

    def _explore(self, params: Params, lights: DeviceBuffer, progress: DeviceBuffer) -> int:
        """Launches paths until there are enough lights; returns how many it took."""
        progress.upload(np.zeros(1, PROGRESS))
        most = max(1000 * params.vpls, 100_000_000)
        launched = done = 0
        while done < params.vpls:
            batch = min(max((params.vpls - done) // 2, 4 * _GROUP), 1024 * _GROUP)
            for paths in _rounds(range(launched, launched + batch), params.max_bounces):
                with self._gpu.stage("trace_vpls") as encoder:
                    self._round(encoder, params, paths, lights, progress)
            launched += batch
            done = int(progress.numpy()[0]["done"])
            if done == 0 and launched >= _PATIENCE:
                raise LabError(f"none of {launched} rays from the lights reached a surface that reflects")
            if done < params.vpls and launched >= most:
                raise LabError(f"only {done} of {launched} rays from the lights reached a surface that reflects")
        with self._gpu.stage("trace_vpls") as encoder:
            self._share_power(encoder, params, lights, progress)
        return int(progress.numpy()[0]["launched"])

    def _round(
        self,
        encoder: spy.CommandEncoder,
        params: Params,
        paths: range,
        lights: DeviceBuffer,
        progress: DeviceBuffer,
    ) -> None:
        """Follows the paths with the numbers `paths`, and appends their lights."""
        gpu, bounces, threads = self._gpu, params.max_bounces, len(paths)
        groups = -(-threads // _GROUP)
        found = gpu.pool.take(threads * bounces, INPUT_LIGHT, "found lights")
        count = gpu.pool.take(threads, "u4", "lights of each path")
        group_first = gpu.pool.take(groups, "u4", "lights of groups of paths")
        gpu.ray_program("trace_vpls", _SHADERS).dispatch(
            encoder,
            [threads, 1, 1],
            scene=self._scene.uniform,
            lights=self._lights.uniform,
            sources=self._lights.sources,
            source_count=len(self._lights.sources),
            first_path=paths.start,
            max_bounces=bounces,
            seed=params.seed,
            found=found,
            count=count,
        )

        def collect(entry: str, width: int, **values: Any) -> None:
            gpu.program("collect_vpls", entry).dispatch(encoder, [width, 1, 1], **values)

        collect("sum_groups", threads, count=count, group_first=group_first, paths=threads)
        collect("scan_groups", _GROUP, group_first=group_first, progress=progress, groups=groups)
        collect(
            "collect",
            threads,
            found=found,
            count=count,
            group_first=group_first,
            lights=lights,
            progress=progress,
            paths=threads,
            first_path=paths.start,
            max_bounces=bounces,
            wanted=params.vpls,
        )

    def _share_power(
        self, encoder: spy.CommandEncoder, params: Params, lights: DeviceBuffer, progress: DeviceBuffer
    ) -> None:
        self._gpu.program("collect_vpls", "share_power").dispatch(
            encoder, [params.vpls, 1, 1], progress=progress, lights=lights, wanted=params.vpls
        )


def _enough_paths(lights: int, lights_per_path: float) -> int:
    """Paths that leave so many lights for any seed: what they leave scatters like their root."""
    mean = lights / lights_per_path
    return math.ceil(mean + 8 * math.sqrt(mean / min(lights_per_path, 1)) + 32)


def _rounds(paths: range, max_bounces: int) -> Iterator[range]:
    """`paths` in runs that leave no more lights than one round may."""
    most = max(_GROUP, _MOST_ROWS // max_bounces // _GROUP * _GROUP)
    for first in range(0, len(paths), most):
        yield paths[first : first + most]
