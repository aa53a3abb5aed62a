"""The layers that a frame on the device has, and their values, pixel by pixel; nothing is read back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.hierarchy import hierarchy_parts
from lab.engine.vulkan.lighting import lighting_parts
from lab.engine.vulkan.records import parts
from lab.engine.vulkan.shadows import SignalParts, shadow_parts, signal_parts
from lab.errors import LabError
from lab.layers import find_layer, known_names
from lab.params import Params
from lab.records import Frame

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu

COUNTED = ("overdraw", "lights_used")
"""Layers, and with ``.L3`` those of one level, that need a frame with counts."""

_ABSENT = ("entropy", "effective_lights", "mean_level", "blocked", "level_light", "reference", "error", "flip")
_OF_PICKS = ("shadow_ratio_noisy", "shadowed_noisy", "weight_noisy", "shadowed", "weight")


def layer_names(params: Params, top: int) -> list[str]:
    """Of every layer that can be shown, in the order of menus; `top`: the coarsest level."""
    levels = range(min(params.first_level, top), top + 1)
    return [name for name in known_names(levels, params.shadow_samples) if _has(name, params)]


def _has(name: str, params: Params) -> bool:
    base = name.partition(".")[0]
    if base in ("irradiance", "tile"):
        return params.interleave > 1
    if base in ("left_out", "left_out_noisy"):
        return params.compensation != "none"
    if base in _OF_PICKS:
        return params.shadow_samples > 0
    return base not in _ABSENT


def needs_counts(name: str) -> bool:
    """Whether the layer is one of :data:`COUNTED`."""
    return name.partition(".")[0] in COUNTED


def record_values(gpu: Gpu, encoder: spy.CommandEncoder, frame: Frame, name: str) -> DeviceBuffer:
    """The layer's values: 4f4, up to three numbers a pixel, and 1 where there is a value, else 0."""
    return _Values(gpu, encoder, frame, name).record()


class _Values:
    """One layer, being recorded."""

    def __init__(self, gpu: Gpu, encoder: spy.CommandEncoder, frame: Frame, name: str) -> None:
        self.gpu, self.encoder, self.frame, self.name = gpu, encoder, frame, name
        self.view = gbuffer_parts(gpu, frame.gbuffer)
        self.values = gpu.pool.take(self.view.pixels, "4f4", f"values of {name}")

    def record(self) -> DeviceBuffer:
        base, _, part = self.name.partition(".")
        if base in COUNTED:
            self._counts(base, part)
        elif base in ("picked_level", "pick_probability"):
            self._pick(base, int(part))
        else:
            makers = self._plain()
            if base not in makers:
                raise LabError(f"layer {self.name!r} can't be shown on the device")
            makers[base]()
        return self.values

    def _plain(self) -> Mapping[str, Callable[[], None]]:
        gpu, frame, view = self.gpu, self.frame, self.view
        image: Any = parts(frame.image)
        traced, filtered = shadow_parts(gpu, frame.shadows), signal_parts(gpu, frame.filtered)
        noisy, irradiance = traced.signal, lighting_parts(gpu, frame.lighting).irradiance
        colours: dict[str, DeviceBuffer | None] = {
            **{name: getattr(image, name) for name in ("colour", "direct", "indirect", "unshadowed")},
            "irradiance": irradiance,
            "sun_and_lamps": traced.direct,
            "area_noisy": noisy.area,
            "area": filtered.area,
            "left_out_noisy": noisy.left_out,
            "left_out": filtered.left_out,
            **{name: getattr(view, name) for name in ("albedo", "normal", "geometric_normal", "position", "emission")},
        }
        numbers = {
            "shadow_ratio": image.shadow_ratio,
            "shadowed_noisy": noisy.shadowed,
            "weight_noisy": noisy.weight,
            "shadowed": filtered.shadowed,
            "weight": filtered.weight,
        }
        makers = {name: partial(self._run, "take_colours", source=of) for name, of in colours.items() if of is not None}
        for name, source in numbers.items():
            makers[name] = partial(self._run, "take_numbers", source=source, channels=noisy.channels)
        return makers | {
            "shadow_ratio_noisy": partial(self._ratios, noisy),
            "depth": partial(self._run, "take_depth"),
            "tile": partial(self._run, "take_tiles", n=frame.params.interleave, width=view.width),
        }

    def _ratios(self, signal: SignalParts) -> None:
        self._run("take_ratios", shadowed=signal.shadowed, weight=signal.weight, channels=signal.channels)

    def _counts(self, base: str, part: str) -> None:
        source = getattr(lighting_parts(self.gpu, self.frame.lighting), base)
        if source is None:
            raise LabError(f"layer {self.name!r}: this frame was rendered without counting lights")
        levels = hierarchy_parts(self.gpu, self.frame.hierarchy)
        first, last = self.frame.params.first_level, levels.most_levels - 1
        if part:
            first = last = int(part[1:])
        self._run("take_counts", source=source, info=levels.info, first_level=first, last_level=last)

    def _pick(self, base: str, pick: int) -> None:
        lit = lighting_parts(self.gpu, self.frame.lighting)
        picked = {"picked_light": lit.light, "samples": lit.samples, "pick": pick}
        if base == "picked_level":
            self._run("take_levels", info=hierarchy_parts(self.gpu, self.frame.hierarchy).info, **picked)
        else:
            self._run("take_probabilities", target_weight=lit.target_weight, irradiance=lit.irradiance, **picked)

    def _run(self, entry: str, **named: Any) -> None:
        constants = {"everywhere": int(find_layer(self.name).everywhere)}
        self.gpu.program("present_values", entry, constants).dispatch(
            self.encoder,
            [self.view.pixels, 1, 1],
            position_depth=self.view.position,
            values=self.values,
            pixels=self.view.pixels,
            **named,
        )
