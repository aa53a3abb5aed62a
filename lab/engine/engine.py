"""What an engine is: the seven stages of a frame, one method each."""

from __future__ import annotations

from typing import Protocol

from lab.engine.clock import StageClock
from lab.errors import LabError, nearest
from lab.params import Params
from lab.records import FilteredShadows, GBuffer, Hierarchy, Image, Lighting, Lights, ShadowSamples
from lab.scene.scene import Camera, Scene

STAGES = (
    "trace_vpls",
    "build_hierarchy",
    "render_gbuffer",
    "light",
    "trace_shadow_rays",
    "filter_shadows",
    "composite",
)
"""A stage has this one name everywhere: method, C++ file, test file, row of the timing table."""


class Engine(Protocol):
    """Runs the stages of one scene. Stages keep no state: what they need comes in, what they make goes out."""

    scene: Scene

    def clock(self) -> StageClock:
        """A new clock, which takes the time of one frame's stages."""

    def trace_vpls(self, params: Params) -> Lights:
        """The input lights: VPLs traced from the scene's lights, or the scene's own light list."""

    def build_hierarchy(self, lights: Lights, params: Params) -> Hierarchy:
        """LY19 3.1: all levels, compacted and merged."""

    def render_gbuffer(self, camera: Camera, size: tuple[int, int]) -> GBuffer:
        """What `camera` sees; `size` = (width, height)."""

    def light(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, counts: bool = True) -> Lighting:
        """LY19 3.2 and 3.3: unshadowed light, and the shadow samples picked on the way.

        The `counts` of lights are an instrument: no later stage reads them, and a frame is faster without.
        """

    def trace_shadow_rays(
        self, hierarchy: Hierarchy, gbuffer: GBuffer, lighting: Lighting, params: Params
    ) -> ShadowSamples:
        """LY19 3.3: one ray a shadow sample, and the direct light."""

    def filter_shadows(self, gbuffer: GBuffer, shadows: ShadowSamples, params: Params) -> FilteredShadows:
        """LY19 3.3: edge-stopping filter of the shadow samples."""

    def composite(
        self, gbuffer: GBuffer, lighting: Lighting, shadows: ShadowSamples, filtered: FilteredShadows, params: Params
    ) -> Image:
        """The final image; interleaved tiles are recombined here."""


ENGINES = ("cpu", "vulkan")
"""Every engine by name."""


def create_engine(name: str, scene: Scene, *, device: str = "") -> Engine:
    """The engine called `name` (one of :data:`ENGINES`), ready to render `scene`.

    `device`: which Vulkan device, by name or number; empty for the first.
    """
    check_device(name, device)
    if name == "cpu":
        from lab.engine.cpu import CpuEngine

        return CpuEngine(scene)
    from lab.engine.vulkan.device import open_gpu
    from lab.engine.vulkan.engine import VulkanEngine

    return VulkanEngine(scene, open_gpu(device))


def check_lighting(engine: str, params: Params) -> None:
    """Raises :class:`LabError` where the engine called `engine` does not light as `params` say."""
    if engine == "cpu" and params.lighting == "raster":
        raise LabError(
            "lighting=raster: engine cpu has no rasteriser; leave lighting at tiled, or choose engine vulkan "
            "(--engine vulkan)"
        )
    if params.lighting == "raster" and params.picker == "race" and params.reservoir_locks != "atomic_race":
        raise LabError(
            f"picker=race, reservoir_locks={params.reservoir_locks}: with lighting=raster a race needs no lock, and "
            "is reservoir_locks=atomic_race; for reservoirs choose picker=reservoir"
        )


def check_device(engine: str, device: str) -> None:
    """Raises :class:`LabError` for an engine that there is not, and for a device that an engine does not take."""
    if engine not in ENGINES:
        raise LabError(f"unknown engine {engine!r}: there are {', '.join(ENGINES)}{nearest(engine, ENGINES)}")
    if device and engine != "vulkan":
        raise LabError(
            f"device {device!r}: engine {engine} runs on the processor and takes no device; "
            "choose engine vulkan for a graphics card"
        )
