"""Frames that the tests of the inspector share: small, with every kind of light, shadow and background."""

from __future__ import annotations

import dataclasses
from functools import cache

import lab
from lab.engine.cpu import CpuEngine
from lab.records import Frame
from lab.reference import Budget, Reference, brute_force
from lab.scene.scene import Camera, Material, PointLight, SpotLight

from ..oracle_geometry.scenes import occluded_room, quad

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (40, 24)


@cache
def engine() -> CpuEngine:
    """The room, lit by a point, a spot and a lamp; a window of background."""
    lamp = quad((-0.5, 1.95, -0.5), (0.5, 1.95, -0.5), (0.5, 1.95, 0.5), (-0.5, 1.95, 0.5), 3)
    scene = occluded_room(
        points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 3.0))], spots=[SpotLight((0, 1.9, 1), (0, -1, -0.5), (4, 4, 4))]
    )
    walls = dataclasses.replace(scene.meshes[0], index=scene.meshes[0].index[:10])
    materials = [*scene.materials, Material("lamp", emission=(4.0, 3.0, 2.0))]
    return CpuEngine(
        dataclasses.replace(
            scene, meshes=[walls, *scene.meshes[1:], lamp], materials=materials, background=(0.2, 0.3, 0.5)
        )
    )


@cache
def frame(counts: bool = True, **settings: object) -> Frame:
    """The room from inside, 600 lights; `settings` of Params."""
    params = lab.Params().replace(**{"vpls": 600, **settings})
    return lab.render(engine().scene, params, camera=CAMERA, size=SIZE, engine=engine(), counts=counts)


@cache
def reference(**settings: object) -> Reference:
    """The same view, every light with its shadow rays."""
    return brute_force(engine(), CAMERA, SIZE, frame(**settings).params, budget=Budget(spp=16))
