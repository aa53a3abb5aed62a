"""Frame after frame of one scene: what costs time once is done once."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, TypeVar

from lab import _core
from lab.engine.engine import Engine, create_engine
from lab.errors import LabError
from lab.frame import Progress
from lab.library import render
from lab.params import Params
from lab.records import FilteredShadows, Frame, GBuffer, Hierarchy, Image, Lighting, Lights, ShadowSamples
from lab.scene.scene import Camera, Scene

T = TypeVar("T")

OF_LIGHTS = ("vpls", "max_bounces", "seed")
"""Settings that VPLs depend on."""

OF_LEVELS = ("bounds_scale", "levels", "construction", "gather_range", "carry_moments", "centre_weight")
"""Settings that the hierarchy of given lights depends on, beside whether its members are drawn from."""


class Renderer:
    """Renders a scene again and again, from any camera and with any settings.

        with lab.Renderer(scene) as renderer:
            for camera in path:
                frame = renderer.render(camera, (1280, 720), lab.Params(shadow_samples=1))

    It keeps the ray tracer's tree, and the memory of the last frames for the next. It also keeps the virtual lights,
    the hierarchy and the G-buffer, and takes them again where nothing that they depend on has changed: another camera
    needs no new lights. ``regenerate=True`` does all seven stages anew, as for a scene that moves.

    Pictures are the same, bit for bit, as those of :func:`lab.render`. Frames may share arrays with each other: treat
    what is in them as read-only. They stay valid after :meth:`close`.
    """

    def __init__(self, scene: Scene, *, engine: str = "cpu", threads: int | None = None) -> None:
        """Builds the ray tracer's tree.

        Args:
            scene: from :func:`lab.load_scene`, or made in Python.
            engine: an engine's name.
            threads: threads of this renderer's frames; default: as many as elsewhere. Results don't depend on it.
        """
        if threads is not None and (int(threads) != threads or threads < 1):
            raise LabError(f"threads: expected a whole number, at least 1, got {threads}")
        self.scene, self.threads = scene, threads
        with self._on_threads():
            self.engine = create_engine(engine, scene)
        self._stages = _KeptStages(self.engine)
        _core.keep_buffers()
        self._release = weakref.finalize(self, _core.release_buffers)

    def render(
        self,
        camera: str | Camera = "",
        size: tuple[int, int] = (1280, 720),
        params: Params | None = None,
        *,
        regenerate: bool = False,
        counts: bool = False,
        progress: Progress | None = None,
    ) -> Frame:
        """One frame; arguments as of :func:`lab.render`, but that lights are counted only if asked.

        With `regenerate` every stage is done anew. Else a stage whose result was taken again has taken no time in
        ``frame.stages_ms``.
        """
        if not self._release.alive:
            raise LabError("Renderer: it is closed; make another to render again")
        if regenerate:
            self._stages.forget()
        with self._on_threads():
            return render(
                self.scene, params, camera=camera, size=size, engine=self._stages, progress=progress, counts=counts
            )

    def close(self) -> None:
        """Gives the kept memory back to the system. Frames that are still held stay as they are."""
        self._stages.forget()
        self._release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @contextmanager
    def _on_threads(self) -> Iterator[None]:
        before = int(_core.info()["threads"])
        _core.set_threads(self.threads or before)
        try:
            yield
        finally:
            _core.set_threads(before)


class _KeptStages:
    """An engine whose first three stages are done only where what goes into them has changed."""

    def __init__(self, engine: Engine) -> None:
        self.engine, self.scene = engine, engine.scene
        self._kept: dict[str, tuple[object, Any]] = {}

    def forget(self, *stages: str) -> None:
        """The next frame does these stages anew; without a name, all."""
        for stage in stages or tuple(self._kept):
            self._kept.pop(stage, None)

    def _once(self, stage: str, key: object, make: Callable[[], T], outdates: tuple[str, ...] = ()) -> T:
        if stage not in self._kept or self._kept[stage][0] != key:
            self.forget(stage, *outdates)  # first: the new one can have their memory
            self._kept[stage] = key, make()
        kept: T = self._kept[stage][1]
        return kept

    def trace_vpls(self, params: Params) -> Lights:
        key = _values(params, OF_LIGHTS)
        return self._once("trace_vpls", key, lambda: self.engine.trace_vpls(params), ("build_hierarchy",))

    def build_hierarchy(self, lights: Lights, params: Params) -> Hierarchy:
        # Of the lights kept: others have outdated what was built.
        members = params.shadow_samples > 0 and params.shadow_points == "members"
        key = members, *_values(params, OF_LEVELS)
        return self._once("build_hierarchy", key, lambda: self.engine.build_hierarchy(lights, params))

    def render_gbuffer(self, camera: Camera, size: tuple[int, int]) -> GBuffer:
        numbers = *camera.eye, *camera.target, *camera.up, camera.fov_y_deg, *size
        key = tuple(map(float, numbers))
        return self._once("render_gbuffer", key, lambda: self.engine.render_gbuffer(camera, size))

    def light(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, counts: bool = True) -> Lighting:
        return self.engine.light(hierarchy, gbuffer, params, counts)

    def trace_shadow_rays(
        self, hierarchy: Hierarchy, gbuffer: GBuffer, lighting: Lighting, params: Params
    ) -> ShadowSamples:
        return self.engine.trace_shadow_rays(hierarchy, gbuffer, lighting, params)

    def filter_shadows(self, gbuffer: GBuffer, shadows: ShadowSamples, params: Params) -> FilteredShadows:
        return self.engine.filter_shadows(gbuffer, shadows, params)

    def composite(
        self, gbuffer: GBuffer, lighting: Lighting, shadows: ShadowSamples, filtered: FilteredShadows, params: Params
    ) -> Image:
        return self.engine.composite(gbuffer, lighting, shadows, filtered, params)


def _values(params: Params, names: tuple[str, ...]) -> tuple[object, ...]:
    return tuple(getattr(params, name) for name in names)
