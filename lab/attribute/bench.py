"""What the budget is measured on: one view of a scene, its exact pictures, and frames with parts of them replaced."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.attribute.terms import ideal
from lab.engine.cpu import CpuEngine
from lab.engine.memory import check_memory
from lab.frame import render_frame
from lab.params import Params
from lab.records import Floats, Frame, GBuffer, Lighting, Lights, ShadowSamples
from lab.reference import Budget, Reference, render_reference
from lab.reference.path_tracer import mean_variance
from lab.scene.scene import Camera, Scene

Doubles = NDArray[np.float64]
Tell = Callable[[float], None]

CONVERGED_SAMPLES = 64
_PATHS_A_STEP = 400_000
_TINY = 1e-300


@dataclass(frozen=True)
class Picture:
    """An indirect layer: (H, W, 3) radiance, and the variance of its noise where there is any."""

    radiance: Doubles
    variance: Doubles | float = 0.0


@dataclass(frozen=True)
class Shadows:
    """Converged shadow samples: S and U averaged over frames, and each frame's own, to know the noise by."""

    params: Params
    lighting: Lighting
    mean: ShadowSamples
    frames: list[ShadowSamples]


class Bench:
    """One view.

    Attributes:
        truth: the path tracer's picture; of a scene lit by a list of lights, every light of it, without any clamp.
        summed: every virtual light of the frame, with every shadow ray.
    """

    truth: Reference
    summed: Reference

    def __init__(self, scene: Scene, camera: Camera, size: tuple[int, int], params: Params, cache: bool = True) -> None:
        self.cache = cache
        self.scene, self.camera, self.size, self.params = scene, camera, size, params
        self.light_list = scene.light_list is not None
        self.ideal = ideal(params)
        self.engine = CpuEngine(scene)
        self.gbuffer: GBuffer = self.engine.render_gbuffer(camera, size)
        self.seen = self.gbuffer.depth > 0
        self.reflectance = self.gbuffer.albedo.astype(np.float64) / np.pi
        self._lights: Lights | None = None

    def trace_truth(self, spp: int, draws: int, tell: Tell) -> None:
        """The truth, by `spp` paths a pixel; of a list of lights by `draws` lights a pixel."""
        if not self.light_list:
            self.truth = self._reference("path_tracer", self.ideal, spp, tell)
            return
        # Another seed, so that its noise is not that of `summed`.
        exact = self.ideal.replace(clamp_distance=0.0, seed=(self.params.seed + 1) % 2**32)
        self.truth = self._reference("brute_force", exact, draws, tell)

    def sum_lights(self, params: Params, draws: int, tell: Tell) -> Reference:
        """Every virtual light of `params` with every shadow ray, by `draws` a pixel where there are more."""
        return self._reference("brute_force", params.replace(compensation="none"), draws, tell)

    def _reference(self, method: str, params: Params, spp: int, tell: Tell) -> Reference:
        return render_reference(
            self.scene,
            method,
            params,
            camera=self.camera,
            size=self.size,
            budget=Budget(spp=spp),
            cache=self.cache,
            engine=self.engine,
            progress=lambda share, _: tell(share),
        )

    def left_out(self, params: Params, paths: int, tell: Tell) -> Picture:
        """What the falloff of `params` leaves out, by so many short paths a pixel."""
        chunk = max(1, _PATHS_A_STEP // self.gbuffer.depth.size)
        sums, squares = np.zeros_like(self.reflectance), np.zeros_like(self.reflectance)
        for first in range(0, paths, chunk):
            tell(first / paths)
            found = self.engine.trace_compensation(self.gbuffer, first, min(chunk, paths - first), params)
            sums += found["irradiance"]
            squares += found["irradiance_square"]
        variance = mean_variance(sums, squares, paths)
        return Picture(sums / paths * self.reflectance, variance * self.reflectance**2)

    def exactly_shadowed(self, params: Params) -> Picture:
        """The hierarchy's unshadowed light, with the shadows of :attr:`summed`: times the share of light it lets by."""
        plain = params.replace(shadow_samples=0, direct_samples=0, filter="none", compensation="none")
        hierarchy = self.engine.build_hierarchy(self.lights, plain)
        lighting = self.engine.light(hierarchy, self.gbuffer, plain, counts=False)
        shadows = self.engine.trace_shadow_rays(hierarchy, self.gbuffer, lighting, plain)
        filtered = self.engine.filter_shadows(self.gbuffer, shadows, plain)
        image = self.engine.composite(self.gbuffer, lighting, shadows, filtered, plain)
        exact = self.summed.unshadowed
        assert exact is not None
        share = np.where(exact > 0, image.unshadowed / np.maximum(exact, _TINY), 0.0)
        return Picture(share * self.summed.indirect, share**2 * self.summed.indirect_variance)

    @property
    def lights(self) -> Lights:
        """The frame's lights."""
        if self._lights is None:
            self._lights = self.engine.trace_vpls(self.params)
        return self._lights

    def shadows(self, params: Params, frames: int, tell: Tell) -> Shadows:
        """Shadow samples of the hierarchy of `params`, averaged over so many frames."""
        check_memory(len(self.lights), self.size, params)
        hierarchy = self.engine.build_hierarchy(self.lights, params)
        found = []
        for i in range(frames):
            tell(i / frames)
            settings = params.replace(frame=(params.frame + i) % 2**32, direct_samples=0, compensation="none")
            lighting = self.engine.light(hierarchy, self.gbuffer, settings, counts=False)
            found.append(_without_rays(self.engine.trace_shadow_rays(hierarchy, self.gbuffer, lighting, settings)))
        sums: dict[str, Floats] = {
            name: np.asarray(np.mean([getattr(f, name) for f in found], axis=0, dtype=np.float64), np.float32)
            for name in ("shadowed", "weight")
        }
        mean = dataclasses.replace(found[0], shadowed=sums["shadowed"], weight=sums["weight"])
        lighting = dataclasses.replace(
            lighting, light=lighting.light[..., :0].copy(), target_weight=lighting.target_weight[..., :0].copy()
        )
        return Shadows(params, lighting, mean, found)

    def shown(self, shadows: Shadows, *, own_light: bool = False) -> Picture:
        """The exact unshadowed light, or with `own_light` the hierarchy's, with these shadows, unfiltered."""
        params = shadows.params.replace(filter="none", compensation="none", interleave=1)

        def composed(samples: ShadowSamples) -> Doubles:
            return self._composed(shadows.lighting, samples, params, own_light)

        radiance, count = composed(shadows.mean), len(shadows.frames)
        if count < 2:
            return Picture(radiance)
        return Picture(radiance, np.var([composed(frame) for frame in shadows.frames], axis=0, ddof=1) / count)

    def once(self, params: Params) -> Picture:
        """The exact unshadowed light with the shadows of one frame of `params`, filtered as they say."""
        plain = params.replace(direct_samples=0, compensation="none", interleave=1)
        check_memory(len(self.lights), self.size, plain)
        hierarchy = self.engine.build_hierarchy(self.lights, plain)
        lighting = self.engine.light(hierarchy, self.gbuffer, plain, counts=False)
        samples = self.engine.trace_shadow_rays(hierarchy, self.gbuffer, lighting, plain)
        return Picture(self._composed(lighting, samples, plain))

    def _composed(self, lighting: Lighting, samples: ShadowSamples, params: Params, own_light: bool = False) -> Doubles:
        exact = self.summed.unshadowed
        assert exact is not None
        if not own_light:
            lighting = dataclasses.replace(lighting, irradiance=exact.astype(np.float32))
        filtered = self.engine.filter_shadows(self.gbuffer, samples, params)
        return self.engine.composite(self.gbuffer, lighting, samples, filtered, params).indirect.astype(np.float64)

    def frame(self, params: Params) -> Frame:
        """A whole frame, as ``lab render`` makes it."""
        lights = len(self.scene.light_list) if self.scene.light_list is not None else params.vpls
        check_memory(lights, self.size, params)
        return render_frame(self.engine, self.camera, self.size, params)


def _without_rays(samples: ShadowSamples) -> ShadowSamples:
    """Only the sums: 64 rays a pixel are a lot of memory."""
    no_points = {name: getattr(samples, name)[:, :, :0].copy() for name in ("point", "member", "omega", "visible")}
    return dataclasses.replace(samples, **no_points)
