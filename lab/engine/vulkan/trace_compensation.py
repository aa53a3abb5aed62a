"""Part of stage trace_shadow_rays: what the clamped falloff leaves out, by short paths (core_cpp/src/path_walk.cpp)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lab.engine.vulkan.program import RayShaders
from lab.engine.vulkan.uniforms import params_uniform
from lab.params import Params

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.buffers import DeviceBuffer
    from lab.engine.vulkan.device import Gpu
    from lab.engine.vulkan.gbuffer import GBufferParts
    from lab.engine.vulkan.scene import DeviceScene
    from lab.engine.vulkan.scene_lights import DeviceLights

_SHADERS = RayShaders(
    "compensate",
    ("miss", "miss_in_sight"),
    (("surface", "nearest", "hole"), ("sight", "", "hole_in_sight")),
    payload_bytes=16,
)


class Compensation:
    """Traces the short paths of one scene."""

    def __init__(self, gpu: Gpu, scene: DeviceScene, lights: DeviceLights) -> None:
        self._gpu, self._scene, self._lights = gpu, scene, lights

    def record(self, encoder: spy.CommandEncoder, view: GBufferParts, params: Params) -> DeviceBuffer:
        """Records the mean irradiance of ``params.compensation_samples`` paths a pixel; rows of float4."""
        left_out = self._gpu.pool.take(view.pixels, "4f4", "left out")
        self._gpu.ray_program("trace_compensation", _SHADERS).dispatch(
            encoder,
            [view.width, view.height, 1],
            scene=self._scene.uniform,
            lights=self._lights.uniform,
            sources={"rows": self._lights.event_sources, "count": len(self._lights.event_sources)},
            gbuffer={name: getattr(view, name) for name in ("position", "normal", "geometric_normal")},
            left_out=left_out,
            params=params_uniform(params),
        )
        return left_out
