"""Stage render_gbuffer: what the camera sees, by one ray through each pixel's centre."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.engine.vulkan.gbuffer import GBufferParts, device_gbuffer
from lab.engine.vulkan.program import RayShaders
from lab.engine.vulkan.scene import DeviceScene
from lab.records import GBuffer
from lab.scene.scene import Camera

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

_SHADERS = RayShaders("see", ("miss",), (("surface", "nearest", "hole"),), payload_bytes=16)
_PLANES = ("position", "normal", "geometric_normal", "albedo", "emission")


def render_gbuffer(gpu: Gpu, scene: DeviceScene, camera: Camera, size: tuple[int, int]) -> GBuffer:
    """The G-buffer of `camera`; `size` = (width, height)."""
    width, height = size
    rays = camera_uniform(camera, size)
    planes = {name: gpu.pool.take(width * height, "4f4", name) for name in _PLANES}
    program = gpu.ray_program("render_gbuffer", _SHADERS)
    with gpu.stage("render_gbuffer") as encoder:
        program.dispatch(encoder, [width, height, 1], scene=scene.uniform, camera=rays, gbuffer=planes)
    reach = float(np.linalg.norm(np.subtract(rays["eye"], scene.centre))) + scene.radius
    return device_gbuffer(GBufferParts(width, height, rays["step"], **planes, camera=rays, reach=reach))


def camera_uniform(camera: Camera, size: tuple[int, int]) -> dict[str, Any]:
    """The value of a shader's ``CameraRays``: axes in double, as core_cpp/include/lab/camera.h finds them."""
    # As the core takes them: float32.
    eye, target, up = (np.array(v, np.float32).astype(np.float64) for v in (camera.eye, camera.target, camera.up))
    forward = _unit(target - eye)
    right = _unit(np.cross(forward, up))
    width, height = size
    fov_y = float(np.float32(camera.fov_y_deg) * np.float32(math.pi) / np.float32(180))
    return {
        "eye": tuple(eye),
        "step": float(np.float32(2 * math.tan(0.5 * fov_y) / height)),
        "forward": tuple(forward),
        "half_width": 0.5 * width,
        "right": tuple(right),
        "half_height": 0.5 * height,
        "up": tuple(np.cross(right, forward)),
    }


def _unit(v: Any) -> Any:
    return v / np.linalg.norm(v)
