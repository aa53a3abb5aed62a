"""Keeping what the stages made where that lies on a device: no question of whether it still holds reads it back."""

from __future__ import annotations

from typing import Any

from lab.engine.dependencies import LEVEL_SETTINGS, STAGE_SETTINGS, draws_members
from lab.engine.kept import KeptStages, setting_values
from lab.engine.vulkan.records import parts
from lab.params import Params
from lab.records import GBuffer, Hierarchy, Lighting, Lights


class KeptOnDevice(KeptStages):
    """As :class:`~lab.engine.kept.KeptStages`, with records that are whole as they come from the engine.

    Nothing is added to a kept one: with counts or members it is another record than without.
    """

    def build_hierarchy(self, lights: Lights, params: Params) -> Hierarchy:
        """As the engine's."""
        values = (*setting_values(params, LEVEL_SETTINGS), draws_members(params))
        return self._take("build_hierarchy", values, (lights,), lambda: self.engine.build_hierarchy(lights, params))

    def light(self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, counts: bool = True) -> Lighting:
        """As the engine's."""
        values = (*setting_values(params, STAGE_SETTINGS["light"]), counts)
        inputs = hierarchy, gbuffer
        return self._take("light", values, inputs, lambda: self.engine.light(*inputs, params, counts))

    def _identity(self, record: Any) -> object:
        """Its buffers, or the first array of a record of the host."""
        own = parts(record)
        return super()._identity(record) if own is None else own
