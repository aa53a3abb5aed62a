"""Stage trace_shadow_rays: one ray a shadow sample, and the direct light (LY19 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lab.engine.dependencies import draws_members
from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.hierarchy import hierarchy_parts
from lab.engine.vulkan.lighting import lighting_parts
from lab.engine.vulkan.members import MemberParts
from lab.engine.vulkan.program import RayShaders
from lab.engine.vulkan.scene import DeviceScene
from lab.engine.vulkan.scene_lights import DeviceLights
from lab.engine.vulkan.shadows import ShadowParts, SignalParts, device_shadows
from lab.engine.vulkan.trace_compensation import Compensation
from lab.engine.vulkan.uniforms import params_uniform
from lab.errors import LabError
from lab.params import Params
from lab.records import GBuffer, Hierarchy, Lighting, ShadowSamples

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

# Nothing is asked of the nearest hit, but there must be a group for it.
_SHADERS = RayShaders("trace", ("miss",), (("surface", "", "hole"),), payload_bytes=4)


@dataclass(frozen=True)
class LitScene:
    """The scene as shadow rays see it: its geometry and its own lights. `no_members`: bound where none are drawn."""

    gpu: Gpu
    geometry: DeviceScene
    lights: DeviceLights
    no_members: MemberParts
    compensation: Compensation


def trace_shadow_rays(
    scene: LitScene, hierarchy: Hierarchy, gbuffer: GBuffer, lighting: Lighting, params: Params
) -> ShadowSamples:
    """Every sample of every pixel, and what they come to.

    Errors: :class:`LabError` where `lighting` was made with another number of samples, or `hierarchy` has no lists to
    draw from.
    """
    gpu = scene.gpu
    drawn = draws_members(params)
    view, lit = gbuffer_parts(gpu, gbuffer), lighting_parts(gpu, lighting)
    levels = hierarchy_parts(gpu, hierarchy, members=drawn)
    if drawn and levels.members is None:
        raise LabError("this hierarchy has no member lists: build it with shadow_points=members and shadow_samples")
    members = levels.members if drawn and levels.members else scene.no_members
    samples, channels = params.shadow_samples, 3 if params.shadow_estimator == "ratio_rgb" else 1
    if lit.samples != samples:
        raise LabError(f"shadow_samples={samples}: the lighting was made with {lit.samples}")
    slots, pool = view.pixels * samples, gpu.pool
    planes = {
        "point": pool.take(slots, "4f4", "shadow points"),
        "member": pool.take(slots, "i4", "members"),
        "omega": pool.take(slots, "f4", "omega"),
        "visible": pool.take(slots, "u4", "visible"),
        "shadowed": pool.take(view.pixels * channels, "f4", "shadowed"),
        "weight": pool.take(view.pixels * channels, "f4", "shadow weight"),
        "direct": pool.take(view.pixels, "4f4", "direct light"),
        "area": pool.take(view.pixels, "4f4", "area light"),
    }
    program = gpu.ray_program("trace_shadow_rays", _SHADERS)
    with gpu.stage("trace_shadow_rays") as encoder:
        program.dispatch(
            encoder,
            [view.width, view.height, 1],
            scene=scene.geometry.uniform,
            lights=scene.lights.uniform,
            tables={"info": levels.info, "lights": levels.lights, "members": members.uniform},
            gbuffer={name: getattr(view, name) for name in ("position", "normal", "geometric_normal")},
            lighting={name: getattr(lit, name) for name in ("irradiance", "light", "target_weight")},
            shadows=planes,
            params=params_uniform(params),
        )
        left_out = scene.compensation.record(encoder, view, params) if params.compensation == "path" else None
    shadowed, weight, area = planes["shadowed"], planes["weight"], planes["area"]
    signal = SignalParts(view.width, view.height, channels, shadowed, weight, area, left_out)
    of_samples = {name: planes[name] for name in ("point", "member", "omega", "visible")}
    return device_shadows(ShadowParts(signal, planes["direct"], samples, **of_samples))
