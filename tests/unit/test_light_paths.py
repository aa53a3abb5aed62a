"""Light paths from lamps outside the scene, which are aimed at it."""

from __future__ import annotations

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.scene.scene import Material, PointLight, SpotLight

from ..oracle_geometry.scenes import quad, scene_of

ALBEDO = np.array([0.8, 0.5, 0.2])
GREY = Material("grey", tuple(ALBEDO))
INTENSITY = (1.0, 2.0, 3.0)


@pytest.mark.parametrize("distance", [0.2, 8.0, 100.0, 1e4])
def test_a_lamp_far_off_gives_its_inverse_square(distance: float) -> None:
    """A small plate under a lamp: irradiance I / d^2 on its area, however little of the sky it covers."""
    side = 0.1 * distance / 8
    plate = quad((-side, 0, side), (side, 0, side), (side, 0, -side), (-side, 0, -side))
    for lamp in (
        {"points": [PointLight((0.0, distance, 0.0), INTENSITY)]},
        {"spots": [SpotLight((0.0, distance, 0.0), (0.0, -1.0, 0.0), INTENSITY, 0.5, 0.9)]},
    ):
        scene = scene_of([plate], [GREY], **lamp)
        lights = CpuEngine(scene).trace_vpls(Params(vpls=20_000, max_bounces=1))
        wanted = (2 * side) ** 2 / distance**2 * np.array(INTENSITY) * ALBEDO
        assert np.allclose(lights.flux.sum(axis=0, dtype=np.float64), wanted, rtol=0.03)
