"""A frame of a small, partly hidden room, to probe pixels of."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from lab.engine.cpu import CpuEngine
from lab.library import render
from lab.params import Params
from lab.records import Frame
from lab.scene.scene import Camera

from .scenes import occluded_room, wall_lights

LIGHTS = wall_lights(3, 200)
SIZE = (24, 16)
INSIDE = Camera("inside", (1.8, 1.7, 1.8), (-1.2, 0.5, -1.0))
COMMON: dict[str, Any] = {"levels": 3, "alpha": 0.7, "filter": "none"}
HIDDEN = (23, 15)


@cache
def engine() -> CpuEngine:
    """Of the room with its lights."""
    return CpuEngine(occluded_room(LIGHTS))


@cache
def room_frame(**settings: Any) -> Frame:
    """From inside; pixel :data:`HIDDEN` is told to see no surface, as the sky would be."""
    e = engine()
    params = Params(**COMMON | settings)
    g = e.render_gbuffer(INSIDE, SIZE)
    planes = {name: getattr(g, name).copy() for name in ("position", "normal", "geometric_normal", "albedo", "depth")}
    for plane in planes.values():
        plane[HIDDEN[1], HIDDEN[0]] = 0
    e = _Blinded(e, replace(g, **planes))  # type: ignore[assignment]
    return render(e.scene, params, camera=INSIDE, size=SIZE, engine=e)


class _Blinded:
    """An engine whose G-buffer is given."""

    def __init__(self, engine: CpuEngine, gbuffer: Any) -> None:
        self._engine, self._gbuffer = engine, gbuffer

    def render_gbuffer(self, camera: Camera, size: tuple[int, int]) -> Any:
        return self._gbuffer

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)


def some_pixels(frame: Frame, step: int = 5) -> list[tuple[int, int]]:
    """(x, y) of every `step`-th pixel that sees a surface."""
    y, x = np.nonzero(frame.gbuffer.depth > 0)
    return list(zip(x[::step].tolist(), y[::step].tolist(), strict=True))
