"""The layers of one frame: which it has, and their values as the records hold them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.blend_curves import drawn_levels
from lab.colour import luminance
from lab.engine.engine import Engine
from lab.errors import LabError
from lab.image_io import count_channels
from lab.layers import find_layer, known_names
from lab.metrics import flip, relative_error
from lab.pixel_layers import (
    interleave_tile,
    level_irradiance,
    pick_probability,
    picked_level,
    ratio_of,
)
from lab.records import Frame
from lab.reference import Reference
from lab.survey import ShadowDistribution, shadow_distribution

Values = NDArray[Any]


_COMPARED = ("reference", "error", "flip")
"""Layers that need a reference, by the first part of their names."""

_SURVEYED = ("entropy", "effective_lights", "mean_level", "blocked")
"""Maps of :class:`lab.survey.ShadowDistribution`."""


class FrameLayers:
    """Layers of `frame` by name; what has to be made is made once, when first asked for.

    Args:
        frame: rendered, with counts or without.
        engine: the one that rendered it; without it there is no light of one level alone.
        reference: what the frame should show; without it there are no errors.
    """

    def __init__(self, frame: Frame, engine: Engine | None = None, reference: Reference | None = None) -> None:
        self.frame, self.engine, self.reference = frame, engine, reference
        self._made: dict[str, Values] = {}
        self._picks: ShadowDistribution | None = None
        if reference is not None and reference.colour.shape != frame.image.colour.shape:
            height, width = reference.colour.shape[:2]
            size = frame.gbuffer.size
            raise LabError(
                f"the reference has {width}x{height} pixels, the frame {size[0]}x{size[1]}: render both at one size"
            )

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(H, W) pixels that see a surface."""
        return np.asarray(self.frame.gbuffer.depth > 0)

    @property
    def names(self) -> list[str]:
        """Of every layer that this frame has, in the order of menus."""
        frame = self.frame
        levels = drawn_levels(frame.hierarchy, frame.params)
        picks = frame.lighting.light.shape[-1]
        return [name for name in known_names(levels, picks) if self._has(name)]

    def _has(self, name: str) -> bool:
        frame, reference = self.frame, self.reference
        base, _, part = name.partition(".")
        if base in _COMPARED:
            if part == "unshadowed":  # FLIP is about what is seen on a screen: of irradiance it says nothing
                return base != "flip" and reference is not None and reference.unshadowed is not None
            return reference is not None
        if base in ("overdraw", "lights_used"):
            return frame.lighting.overdraw is not None
        picked = bool(frame.lighting.light.shape[-1] > 0)
        there = {
            "level_light": self.engine is not None,
            "left_out": frame.filtered.left_out is not None,
            "left_out_noisy": frame.shadows.left_out is not None,
            "shadow_ratio_noisy": picked,
            "shadowed_noisy": picked,
            "weight_noisy": picked,
            "shadowed": picked,
            "weight": picked,
            **dict.fromkeys(_SURVEYED, picked),
            "irradiance": frame.params.interleave > 1,
            "tile": frame.params.interleave > 1,
        }
        return bool(there.get(base, True))

    def values(self, name: str) -> Values:
        """(H, W, 3) or (H, W) values of a layer: the record's own where it holds them. Treat them as read-only."""
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def _make(self, name: str) -> Values:
        find_layer(name)  # an unknown one says so
        base, _, part = name.partition(".")
        if name not in self.names:
            raise LabError(f"this frame has no layer {name!r}: {self._why_not(base)}")
        if base in ("overdraw", "lights_used", "level_light"):
            return self._of_levels(base, part)
        if base in _COMPARED:
            return self._compared(base, part)
        if base in _SURVEYED:
            return np.asarray(getattr(self._distribution(), base))
        frame = self.frame
        if base == "picked_level":
            return picked_level(frame.hierarchy, frame.lighting)[..., int(part)]
        if base == "pick_probability":
            return pick_probability(frame.lighting)[..., int(part)]
        return self._own()[name]()

    def _distribution(self) -> ShadowDistribution:
        if self._picks is None:
            self._picks = shadow_distribution(self.frame)
        return self._picks

    def _of_levels(self, base: str, part: str) -> Values:
        """`part`: L and a level's number, "" for the total."""
        lighting = self.frame.lighting
        if base == "level_light" and self.engine is not None:
            return level_irradiance(self.engine, self.frame, int(part[1:]))
        if not part:
            return count_channels(lighting, self.frame.params.first_level)[f"{base}.Y"]
        overdraw, lights_used = lighting.counts()
        return np.asarray((overdraw if base == "overdraw" else lights_used)[int(part[1:])])

    def _own(self) -> dict[str, Callable[[], Values]]:
        frame = self.frame
        image, gbuffer, shadows, filtered = frame.image, frame.gbuffer, frame.shadows, frame.filtered
        return {
            "colour": lambda: image.colour,
            "direct": lambda: image.direct,
            "indirect": lambda: image.indirect,
            "unshadowed": lambda: image.unshadowed,
            "irradiance": lambda: frame.lighting.irradiance,
            "shadow_ratio": lambda: luminance(image.shadow_ratio),
            "shadow_ratio_noisy": lambda: ratio_of(shadows),
            "shadowed_noisy": lambda: luminance(shadows.shadowed),
            "weight_noisy": lambda: luminance(shadows.weight),
            "shadowed": lambda: luminance(filtered.shadowed),
            "weight": lambda: luminance(filtered.weight),
            "sun_and_lamps": lambda: shadows.direct,
            "area_noisy": lambda: shadows.area,
            "area": lambda: filtered.area,
            "left_out_noisy": lambda: np.asarray(shadows.left_out),
            "left_out": lambda: np.asarray(filtered.left_out),
            "albedo": lambda: gbuffer.albedo,
            "normal": lambda: gbuffer.normal,
            "geometric_normal": lambda: gbuffer.geometric_normal,
            "depth": lambda: gbuffer.depth,
            "position": lambda: gbuffer.position,
            "emission": lambda: gbuffer.emission,
            "tile": lambda: interleave_tile(gbuffer.size, frame.params.interleave),
        }

    def _compared(self, base: str, part: str) -> Values:
        there: Values = getattr(self.reference, part)
        if part == "colour":
            # References know no background: it is the same in any picture of the scene.
            there = np.where(self.seen[..., None], there, self.frame.image.colour)
        if base == "reference":
            return there
        own: Values = getattr(self.frame.image, part)
        if base == "flip":
            return flip(own, there)[1]
        return np.asarray(relative_error(luminance(np.asarray(own, np.float64)), luminance(there)))

    def _why_not(self, base: str) -> str:
        params = self.frame.params
        levels = drawn_levels(self.frame.hierarchy, params)
        reasons = (
            (base in _COMPARED, "it needs a reference that has this part"),
            (base in ("overdraw", "lights_used") and self.frame.lighting.overdraw is None,
             "it was rendered without counting lights (counts=True counts them)"),
            (base in ("irradiance", "tile"), "interleave=1 knows no tiles"),
            (base.startswith("left_out"), "compensation=none brings nothing back"),
            (base == "level_light" and self.engine is None, "light of one level needs the engine"),
            (params.shadow_samples == 0, "shadow_samples=0 picks nothing"),
            (True, f"it draws the levels {levels[0]} to {levels[-1]} and has {params.shadow_samples} picks a pixel"),
        )  # fmt: skip
        return next(reason for holds, reason in reasons if holds)


def layer_names(frame: Frame, engine: Engine | None = None, reference: Reference | None = None) -> list[str]:
    """Names of the layers that a frame has, see :class:`FrameLayers`."""
    return FrameLayers(frame, engine, reference).names


def layer_values(frame: Frame, name: str, engine: Engine | None = None, reference: Reference | None = None) -> Values:
    """(H, W) or (H, W, 3) values of one layer, see :class:`FrameLayers`."""
    return FrameLayers(frame, engine, reference).values(name)
