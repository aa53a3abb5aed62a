"""The Vulkan engine: the seven stages of one scene, all of their data on the device."""

from __future__ import annotations

from lab.engine.vulkan.build_hierarchy import build_hierarchy
from lab.engine.vulkan.composite import composite
from lab.engine.vulkan.device import Gpu
from lab.engine.vulkan.filter_shadows import filter_shadows
from lab.engine.vulkan.light import light
from lab.engine.vulkan.light_raster import RasterLighter
from lab.engine.vulkan.members import no_members
from lab.engine.vulkan.render_gbuffer import render_gbuffer
from lab.engine.vulkan.scene import DeviceScene
from lab.engine.vulkan.scene_lights import upload_lights
from lab.engine.vulkan.timing import DeviceClock
from lab.engine.vulkan.trace_compensation import Compensation
from lab.engine.vulkan.trace_shadow_rays import LitScene, trace_shadow_rays
from lab.engine.vulkan.trace_vpls import VplTracer
from lab.errors import LabError
from lab.params import Params
from lab.records import FilteredShadows, GBuffer, Hierarchy, Image, Lighting, Lights, ShadowSamples
from lab.scene.scene import Camera, Scene


class VulkanEngine:
    """Renders one scene on a Vulkan device. The stages wait for nothing: records are read back when looked at.

    Attributes:
        scene: what it renders.    gpu: the device, which several engines may share.
        device_scene, device_lights: the scene in its memory.
        scene_radius: R, of the bounding sphere of the geometry.

    """

    def __init__(self, scene: Scene, gpu: Gpu | None = None, *, device: str = "") -> None:
        """Opens the device that `device` names, unless `gpu` is one already."""
        self.scene = scene
        self.gpu = gpu or Gpu(device)
        self.device_scene = DeviceScene(self.gpu, scene)
        self.device_lights = upload_lights(self.gpu, scene, self.device_scene)
        self.scene_radius = self.device_scene.radius
        self._lit = LitScene(
            self.gpu,
            self.device_scene,
            self.device_lights,
            no_members(self.gpu),
            Compensation(self.gpu, self.device_scene, self.device_lights),
        )
        self._raster = RasterLighter(self.gpu)
        self._vpls = VplTracer(self.gpu, self.device_scene, self.device_lights)

    def clock(self) -> DeviceClock:
        """The device's own, by timestamps."""
        return DeviceClock(self.gpu)

    def build_hierarchy(self, lights: Lights, params: Params) -> Hierarchy:
        """LY19 3.1: all levels, compacted and merged."""
        return build_hierarchy(self.gpu, lights, params)

    def stages_ms(self) -> dict[str, float]:
        """What the device took for the last run of each stage, by its own clock; waits for them."""
        return self.gpu.stages_ms()

    def trace_vpls(self, params: Params) -> Lights:
        """VPLs by paths from the scene's lights; a scene with a light list is lit by that list instead."""
        if self.scene.light_list is not None:
            return self.scene.light_list
        try:
            return self._vpls.trace(params)
        except LabError as error:
            raise LabError(
                f"{self.scene.name}: {error}. Turn a light toward the scene (--sun x,y,z), or give it another"
            ) from None

    def render_gbuffer(self, camera: Camera, size: tuple[int, int]) -> GBuffer:
        """One ray through each pixel's centre."""
        return render_gbuffer(self.gpu, self.device_scene, camera, size)

    def light(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, counts: bool = True) -> Lighting:
        """LY19 3.2, 3.3: tiles of pixels, each with its own culled lists of lights; or the paper's rasterised cubes."""
        if params.lighting == "raster":
            return self._raster.light(hierarchy, gbuffer, params, self.scene_radius, counts=counts)
        return light(self.gpu, hierarchy, gbuffer, params, self.scene_radius, counts=counts)

    def trace_shadow_rays(
        self, hierarchy: Hierarchy, gbuffer: GBuffer, lighting: Lighting, params: Params
    ) -> ShadowSamples:
        """LY19 3.3: one ray to each sample's stored point, and the direct light."""
        if params.compensation == "path" and self.scene.light_list is not None:
            raise LabError(
                f"compensation=path: {self.scene.name} is lit by a list of point lights, not by surfaces that short "
                "paths could find; leave it at none"
            )
        return trace_shadow_rays(self._lit, hierarchy, gbuffer, lighting, params)

    def filter_shadows(self, gbuffer: GBuffer, shadows: ShadowSamples, params: Params) -> FilteredShadows:
        """The fused kernels, or kornia."""
        return filter_shadows(self.gpu, gbuffer, shadows, params, self.scene_radius)

    def composite(
        self, gbuffer: GBuffer, lighting: Lighting, shadows: ShadowSamples, filtered: FilteredShadows, params: Params
    ) -> Image:
        """Interleaved tiles recombined, shadows applied, direct light added."""
        return composite(
            self.gpu, gbuffer, lighting, shadows, filtered, background=self.scene.background, params=params
        )
