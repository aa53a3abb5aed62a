"""An engine that keeps what its stages made last, and makes again only what a change touches."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from lab.engine.clock import StageClock
from lab.engine.dependencies import LEVEL_SETTINGS, STAGE_SETTINGS, draws_members, outdated_by
from lab.engine.engine import Engine
from lab.params import Params
from lab.records import FilteredShadows, GBuffer, Hierarchy, Image, Lighting, Lights, ShadowSamples
from lab.scene.scene import Camera

T = TypeVar("T")

_COUNTS = "overdraw", "lights_used", "fragments"


@dataclass(frozen=True)
class Made:
    """A stage's last result, and what it was made from: values of settings, and one array of each record."""

    values: tuple[object, ...]
    inputs: tuple[object, ...]
    record: Any


class KeptStages:
    """The stages of one frame over `engine`: a result in `kept` is taken again where nothing it depends on changed.

    What is outdated leaves `kept` before the new one is made, which can then have its memory. A stage that is broken
    off leaves nothing behind. ``ran`` names the stages that the engine did.
    """

    def __init__(self, engine: Engine, kept: dict[str, Made]) -> None:
        self.engine, self.scene = engine, engine.scene
        self.ran: set[str] = set()
        self._kept = kept

    def clock(self) -> StageClock:
        """The engine's."""
        return self.engine.clock()

    def trace_vpls(self, params: Params) -> Lights:
        """As the engine's."""
        if self.scene.light_list is not None:
            return self.engine.trace_vpls(params)  # the list itself, whatever the settings
        values = setting_values(params, STAGE_SETTINGS["trace_vpls"])
        return self._take("trace_vpls", values, (), lambda: self.engine.trace_vpls(params))

    def build_hierarchy(self, lights: Lights, params: Params) -> Hierarchy:
        """As the engine's. Kept levels with member lists serve without them, and get them where they had none."""
        values = setting_values(params, LEVEL_SETTINGS)

        def make() -> Hierarchy:
            return self.engine.build_hierarchy(lights, params)

        made = self._take("build_hierarchy", values, (lights,), make)
        if not draws_members(params):
            return made if made.members is None else dataclasses.replace(made, members=None)
        return made if made.members is not None else self._completed("build_hierarchy", make, ("members",))

    def render_gbuffer(self, camera: Camera, size: tuple[int, int]) -> GBuffer:
        """As the engine's."""
        values = tuple(map(float, (*camera.eye, *camera.target, *camera.up, camera.fov_y_deg, *size)))
        return self._take("render_gbuffer", values, (), lambda: self.engine.render_gbuffer(camera, size))

    def light(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, counts: bool = True) -> Lighting:
        """As the engine's. A kept result with counts serves without them, and gets them where it had none."""
        values = setting_values(params, STAGE_SETTINGS["light"])

        def make() -> Lighting:
            return self.engine.light(hierarchy, gbuffer, params, counts)

        made = self._take("light", values, (hierarchy, gbuffer), make)
        if not counts:
            if made.overdraw is None:
                return made
            return dataclasses.replace(made, overdraw=None, lights_used=None, fragments=None)
        return made if made.overdraw is not None else self._completed("light", make, _COUNTS)

    def trace_shadow_rays(
        self, hierarchy: Hierarchy, gbuffer: GBuffer, lighting: Lighting, params: Params
    ) -> ShadowSamples:
        """As the engine's."""
        values = setting_values(params, STAGE_SETTINGS["trace_shadow_rays"])
        inputs = hierarchy, gbuffer, lighting
        return self._take("trace_shadow_rays", values, inputs, lambda: self.engine.trace_shadow_rays(*inputs, params))

    def filter_shadows(self, gbuffer: GBuffer, shadows: ShadowSamples, params: Params) -> FilteredShadows:
        """As the engine's."""
        values = setting_values(params, STAGE_SETTINGS["filter_shadows"])
        inputs = gbuffer, shadows
        return self._take("filter_shadows", values, inputs, lambda: self.engine.filter_shadows(*inputs, params))

    def composite(
        self, gbuffer: GBuffer, lighting: Lighting, shadows: ShadowSamples, filtered: FilteredShadows, params: Params
    ) -> Image:
        """As the engine's."""
        values = setting_values(params, STAGE_SETTINGS["composite"])
        inputs = gbuffer, lighting, shadows, filtered
        return self._take("composite", values, inputs, lambda: self.engine.composite(*inputs, params))

    def _take(self, stage: str, values: tuple[object, ...], inputs: tuple[object, ...], make: Callable[[], T]) -> T:
        """The kept result of `stage` if it was made from these very values and inputs; else a new one."""
        arrays = tuple(map(self._identity, inputs))
        if not self._has(stage, values, arrays):
            for name in outdated_by(stage):
                self._kept.pop(name, None)
            self.ran.add(stage)
            self._kept[stage] = Made(values, arrays, make())
        record: T = self._kept[stage].record
        return record

    def _identity(self, record: Any) -> object:
        """What stands for a record: its first array, which with and without counts or members is the same one."""
        return getattr(record, dataclasses.fields(record)[0].name)

    def _has(self, stage: str, values: tuple[object, ...], arrays: tuple[object, ...]) -> bool:
        made = self._kept.get(stage)
        return (
            made is not None and made.values == values and all(a is b for a, b in zip(made.inputs, arrays, strict=True))
        )

    def _completed(self, stage: str, make: Callable[[], T], fields: tuple[str, ...]) -> T:
        """The kept result with `fields` of a new one. Its arrays stay the same, and what was made of them stays valid.

        The new one's other arrays would have the same bits.
        """
        self.ran.add(stage)
        made, new = self._kept[stage], make()
        record: T = dataclasses.replace(made.record, **{name: getattr(new, name) for name in fields})
        self._kept[stage] = dataclasses.replace(made, record=record)
        return record


def setting_values(params: Params, names: tuple[str, ...]) -> tuple[object, ...]:
    """Of these settings."""
    return tuple(getattr(params, name) for name in names)
