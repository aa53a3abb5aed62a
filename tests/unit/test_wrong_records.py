"""Records that do not belong together are refused; they never crash the core."""

from __future__ import annotations

import numpy as np
import pytest

import lab
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.scene.scene import Camera, Material, Scene, SunLight

from ..oracle_geometry.scenes import quad, scene_of

FLOOR = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))


def test_shadow_rays_refuse_lighting_of_another_hierarchy() -> None:
    engine = CpuEngine(scene_of([FLOOR], [Material()], suns=[SunLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0))]))
    gbuffer = engine.render_gbuffer(Camera("c", (0.0, 2.0, 2.0), (0.0, 0.0, 0.0)), (16, 9))
    above = np.random.default_rng(1).uniform((-1, 0.5, -1), (1, 1, 1), (400, 3))
    many, few = (lab.Lights(position=above[:n], flux=np.ones((n, 3))) for n in (400, 3))
    params = Params()
    lighting = engine.light(engine.build_hierarchy(many, params), gbuffer, params)
    assert lighting.light.max() > 30
    with pytest.raises(ValueError, match="hierarchy"):
        engine.trace_shadow_rays(engine.build_hierarchy(few, params), gbuffer, lighting, params)


@pytest.mark.parametrize("shape", [(0, 4, 4), (4, 0, 4), (2, 2, 3)])
def test_textures_need_pixels_and_four_channels(shape: tuple[int, int, int]) -> None:
    scene = Scene("s", [FLOOR], [Material(texture=0)], [np.zeros(shape, np.uint8)])
    with pytest.raises(TypeError, match="texture"):
        CpuEngine(scene)


@pytest.mark.parametrize(("position", "flux"), [(3e38, 1.0), (0.0, 3e38)])
def test_lights_that_float32_can_not_sum_are_refused(position: float, flux: float) -> None:
    places = np.full((4, 3), position) * [[1], [-1], [1], [-1]]
    with pytest.raises(LabError, match="choose other units"):
        lab.Lights(position=places, flux=np.full((4, 3), flux))


def test_traced_lights_are_checked_by_magnitude() -> None:
    position, flux, normal = (np.full((3, 3), value, np.float32) for value in (1.0, 2.0, 0.0))
    lights = lab.Lights.of_paths(position, flux, normal, 7)
    assert lights.position is position and lights.flux is flux and lights.normal is normal
    assert lights.paths_launched == 7
    for name, bad in (("position", np.nan), ("position", -2e30), ("flux", 9e29), ("flux", np.inf), ("normal", 2.0)):
        arrays = {"position": position, "flux": flux, "normal": normal}
        arrays[name] = np.full((3, 3), bad, np.float32)
        with pytest.raises(LabError, match="Lights"):
            lab.Lights.of_paths(**arrays, paths_launched=7)
