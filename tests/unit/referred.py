"""A scene with one of everything, and references of it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from lab.records import Lights
from lab.reference import Budget, Reference, render_reference
from lab.scene.scene import Camera, Material, PointLight, Scene, SpotLight, SunLight

from ..oracle_geometry.scenes import quad

SIZE = (10, 6)


def scene() -> Scene:
    """One of everything."""
    floor = quad((-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3), 0, uv=True)
    up = np.tile(np.array([0, 1, 0], np.float32), (4, 1))
    floor = dataclasses.replace(floor, normal=up, colour=np.full((4, 3), 0.9, np.float32))
    return Scene(
        "everything",
        [floor, quad((-2, 0, -2), (2, 0, -2), (2, 2, -2), (-2, 2, -2), 1)],
        [Material("floor", texture=0), Material("wall", (0.5, 0.6, 0.7), emission=(0.1, 0.2, 0.3))],
        textures=[np.full((2, 2, 4), 200, np.uint8)],
        suns=[SunLight((0.3, 1.0, 0.4), (3.0, 2.0, 1.0))],
        points=[PointLight((1.0, 1.5, 0.0), (1.0, 1.0, 2.0))],
        spots=[SpotLight((0.0, 2.0, 1.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0), 0.2, 0.5)],
        cameras=[Camera("front", (0.0, 1.5, 3.0), (0.0, 0.8, 0.0))],
    )


def listed(lights: Lights | None = None) -> Scene:
    at = np.array([[0, 1, 0], [1, 1, 0]], np.float32)
    rows = lights or Lights(at, np.ones_like(at), np.array([[0, -1, 0], [0, 0, 0]], np.float32))
    return dataclasses.replace(scene(), light_list=rows)


def refer(given: Scene | None = None, method: str = "path_tracer", spp: int = 16, **more: Any) -> Reference:
    return render_reference(given or scene(), method, size=SIZE, budget=Budget(spp=spp), **more)
