"""The CPU engine: the seven stages over the C++ core."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab import _core
from lab.engine.clock import HostClock
from lab.engine.dependencies import draws_members
from lab.engine.engine import check_lighting
from lab.engine.simd import use_simd_of_environment
from lab.errors import LabError
from lab.params import Params
from lab.records import (
    FilteredShadows,
    Floats,
    Frame,
    GBuffer,
    Hierarchy,
    Image,
    Lighting,
    Lights,
    Members,
    ShadowSamples,
)
from lab.scene.scene import Camera, Mesh, Scene

Doubles = NDArray[np.float64]

use_simd_of_environment()


class CpuEngine:
    """Renders one scene on the CPU. Building it builds the ray tracer's tree; the stages keep no state."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._core_scene = _core_scene(scene)
        self.scene_radius = float(self._core_scene.radius)

    def visible(self, gbuffer: GBuffer, y: int, x: int, targets: Floats) -> NDArray[np.bool_]:
        """Which of the (n, 3) `targets` pixel (x, y) sees, along the very rays that shadow samples use."""
        point, side = gbuffer.position[y, x], gbuffer.geometric_normal[y, x]
        free: NDArray[np.uint8] = self._core_scene.visible_from(point[None], side[None], targets)
        return free.astype(bool)

    def trace_paths(
        self, gbuffer: GBuffer, camera: Camera | None, first: int, count: int, params: Params
    ) -> dict[str, Doubles]:
        """Sums over camera paths `first` .. `first + count - 1` of every pixel, for :mod:`lab.reference`.

        Returns ``direct``, ``indirect``, ``colour`` and their ``_square``, (H, W, 3) each. Paths start at the
        G-buffer's points; with `camera`, anywhere in the pixel.
        """
        settings = params.to_core()
        return _core.trace_paths(self._core_scene, self.scene.light_list, gbuffer, camera, first, count, settings)

    def trace_direct(self, gbuffer: GBuffer, first: int, count: int, params: Params) -> dict[str, Doubles]:
        """As :meth:`trace_paths`, but only light straight from the scene's lights, without its light list."""
        settings = params.to_core() | {"max_bounces": 0}
        return _core.trace_paths(self._core_scene, None, gbuffer, None, first, count, settings)

    def trace_compensation(self, gbuffer: GBuffer, first: int, count: int, params: Params) -> dict[str, Doubles]:
        """Sums of the irradiance that the falloff leaves out, ``irradiance`` and ``irradiance_square``, (H, W, 3)."""
        return _core.trace_compensation(self._core_scene, gbuffer, first, count, params.to_core())

    def brute_force(
        self, lights: Lights, gbuffer: GBuffer, rows: tuple[int, int], params: Params, *, draws: int, pass_number: int
    ) -> dict[str, Any]:
        """Irradiance of rows first..last-1 from all `lights`, shadowed by `draws` rays a pixel (0: a ray to each).

        Returns ``unshadowed``, ``irradiance`` and its ``variance``, (rows, W, 3) float64, and ``exact_pixels``.
        """
        return _core.brute_force(self._core_scene, lights, gbuffer, *rows, draws, pass_number, params.to_core())

    def light_kernel_rate(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params) -> float:
        """Pairs of pixel and light a second that stage light's kernel evaluates on perfect lists; 0: there are none."""
        return _core.light_kernel_rate(hierarchy, gbuffer, params.to_core(), self.scene_radius)

    def plain_light_rate(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params) -> float:
        """The same of a plain kernel: the formulas as they stand, in a loop that the compiler makes wide."""
        return _core.plain_light_rate(hierarchy, gbuffer, params.to_core(), self.scene_radius)

    def embree_alone(self, stage: str, frame: Frame) -> tuple[int, float]:
        """Of a stage that traces rays: how many, and the seconds that Embree alone takes for these very rays."""
        scene, settings, (width, height) = self._core_scene, frame.params.to_core(), frame.gbuffer.size
        if stage == "trace_vpls":
            if self.scene.light_list is not None:
                return 0, 0.0
            found = _core.limit_vpl_rays(scene, settings, 1)
        elif stage == "render_gbuffer":
            found = _core.limit_gbuffer_rays(scene, frame.camera, width, height, 1)
        else:
            found = _core.limit_shadow_rays(scene, frame.hierarchy, frame.gbuffer, frame.lighting, settings, 1)
        return found["rays"], found["seconds"]

    def clock(self) -> HostClock:
        """The processor's."""
        return HostClock()

    def trace_vpls(self, params: Params) -> Lights:
        """VPLs by paths from the scene's lights; a scene with a light list is lit by that list instead."""
        if self.scene.light_list is not None:
            return self.scene.light_list
        try:
            found = _core.trace_vpls(self._core_scene, params.to_core())
        except _core.UnlitSceneError as error:
            raise LabError(
                f"{self.scene.name}: {error}. Turn a light toward the scene (--sun x,y,z), or give it another"
            ) from None
        return Lights.of_paths(**found)

    def build_hierarchy(self, lights: Lights, params: Params) -> Hierarchy:
        """LY19 3.1; see :func:`build_hierarchy`."""
        return build_hierarchy(lights, params)

    def render_gbuffer(self, camera: Camera, size: tuple[int, int]) -> GBuffer:
        """One ray through each pixel's centre."""
        return GBuffer(**_core.render_gbuffer(self._core_scene, camera, *size))

    def light(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, counts: bool = True) -> Lighting:
        """LY19 3.2, 3.3: groups of pixels, each with its own culled list of lights."""
        check_lighting("cpu", params)
        return Lighting(**_core.light(hierarchy, gbuffer, params.to_core(), self.scene_radius, counts))

    def trace_shadow_rays(
        self, hierarchy: Hierarchy, gbuffer: GBuffer, lighting: Lighting, params: Params
    ) -> ShadowSamples:
        """LY19 3.3: one ray to each sample's stored point, and the direct light."""
        check_compensation(self.scene, params)
        return ShadowSamples(
            **_core.trace_shadow_rays(self._core_scene, hierarchy, gbuffer, lighting, params.to_core())
        )

    def filter_shadows(self, gbuffer: GBuffer, shadows: ShadowSamples, params: Params) -> FilteredShadows:
        """The fused C++ kernel, or kornia."""
        if params.filter_backend == "kornia":
            from lab import filters

            return filters.filter_shadows(gbuffer, shadows, params, self.scene_radius)
        settings, left_out = params.to_core(), shadows.left_out
        if left_out is not None:
            from lab.filters import by_geometry_alone

            alone = by_geometry_alone(params).to_core()
            left_out = _core.filter_irradiance(gbuffer, left_out, alone, self.scene_radius)
        return FilteredShadows(
            *_core.filter_shadows(gbuffer, shadows.shadowed, shadows.weight, shadows.area, settings, self.scene_radius),
            left_out,
        )

    def composite(
        self, gbuffer: GBuffer, lighting: Lighting, shadows: ShadowSamples, filtered: FilteredShadows, params: Params
    ) -> Image:
        """Interleaved tiles recombined, shadows applied, direct light added."""
        background = self.scene.background
        return Image(**_core.composite(gbuffer, lighting, shadows, filtered, background, params.to_core()))


def check_compensation(scene: Scene, params: Params) -> None:
    """Raises :class:`LabError` where ``compensation=path`` has nothing to work on: lights without surfaces."""
    if params.compensation == "path" and scene.light_list is not None:
        raise LabError(
            f"compensation=path: {scene.name} is lit by a list of point lights, not by surfaces that short paths could "
            "find; leave it at none"
        )


def build_hierarchy(lights: Lights, params: Params | None = None) -> Hierarchy:
    """The lighting grid hierarchy of any lights (LY19 3.1), ready for anyone's own renderer.

    The member lists that shadow points are drawn from are built where `params` will draw from them.
    """
    params = params or Params()
    hierarchy = build_levels(lights, params)
    if draws_members(params):
        return replace(hierarchy, members=build_members(hierarchy, params))
    return hierarchy


def build_levels(lights: Lights, params: Params) -> Hierarchy:
    """The hierarchy without member lists."""
    return Hierarchy(**_core.build_hierarchy(lights, params.to_core()))


def build_members(hierarchy: Hierarchy, params: Params) -> Members:
    """The lists that shadow points are drawn from; `params`: those that `hierarchy` was built with."""
    return Members(**_core.build_members(hierarchy, params.to_core()))


def _core_scene(scene: Scene) -> _core.Scene:
    """All meshes as one soup of triangles; a mesh without an attribute gets its neutral value."""
    meshes = scene.meshes
    counts = [len(mesh.position) for mesh in meshes]
    first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.uint32)

    def joined(
        value: Callable[[Mesh], NDArray[np.float32] | None], neutral: float, columns: int
    ) -> NDArray[np.float32]:
        parts = [value(mesh) for mesh in meshes]
        filled = [
            np.full((n, columns), neutral, np.float32) if part is None else part
            for part, n in zip(parts, counts, strict=True)
        ]
        return np.ascontiguousarray(np.concatenate(filled), np.float32)

    return _core.Scene(
        position=joined(lambda mesh: mesh.position, 0, 3),
        normal=joined(lambda mesh: mesh.normal, 0, 3),
        uv=joined(lambda mesh: mesh.uv, 0, 2),
        colour=joined(lambda mesh: mesh.colour, 1, 3),
        triangle=np.concatenate([mesh.index + start for mesh, start in zip(meshes, first, strict=True)]).astype(
            np.uint32
        ),
        material_of=np.repeat(
            np.array([mesh.material for mesh in meshes], np.uint32), [len(mesh.index) for mesh in meshes]
        ),
        scene=scene,
    )
