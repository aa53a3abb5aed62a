"""Frames that the tests of the inspector share: small, with every kind of light, shadow and background."""

from __future__ import annotations

from functools import cache

import lab
from lab.engine.cpu import CpuEngine
from lab.records import Frame
from lab.reference import Budget, Reference, brute_force
from lab.scene.scene import Camera

from ..oracle_geometry.scenes import lamp_room

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (40, 24)


@cache
def engine() -> CpuEngine:
    """Of a room with every kind of light."""
    return CpuEngine(lamp_room())


@cache
def frame(counts: bool = True, **settings: object) -> Frame:
    """The room from inside, 600 lights; `settings` of Params."""
    params = lab.Params().replace(**{"vpls": 600, **settings})
    return lab.render(engine().scene, params, camera=CAMERA, size=SIZE, engine=engine(), counts=counts)


@cache
def reference(**settings: object) -> Reference:
    """The same view, every light with its shadow rays."""
    return brute_force(engine(), CAMERA, SIZE, frame(**settings).params, budget=Budget(spp=16))
