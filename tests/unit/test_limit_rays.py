"""Embree alone on a stage's own rays: as many rays as the stage traces, and a time."""

from __future__ import annotations

import numpy as np
import pytest

from lab import _core
from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.scene.scene import Camera, PointLight, SpotLight, SunLight

from ..oracle_geometry.scenes import box, scene_of

CAMERA = Camera("c", (0.1, 1.0, 1.9), (0.0, 0.9, 0.0), fov_y_deg=75.0)


def room(**lights: object) -> CpuEngine:
    return CpuEngine(scene_of([box((-2, 0, -2), (2, 2, 2), 0, inward=True)], **lights))


@pytest.mark.parametrize("size", [(1, 1), (33, 18), (64, 36)])
def test_one_ray_a_pixel(size: tuple[int, int]) -> None:
    found = _core.limit_gbuffer_rays(room()._core_scene, CAMERA, *size, 3)
    assert found["rays"] == size[0] * size[1]
    assert 0 < found["seconds"] < 10


@pytest.mark.parametrize("estimator", ["ratio", "average"])
def test_as_many_shadow_rays_as_the_stage_traces(estimator: str) -> None:
    engine = room(
        suns=[SunLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0))],
        points=[PointLight((0.0, 1.5, 0.0), (1.0, 1.0, 1.0))],
        spots=[SpotLight((0.0, 1.9, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0), outer_angle=0.6)],
    )
    params = Params(vpls=500, shadow_estimator=estimator)
    hierarchy = engine.build_hierarchy(engine.trace_vpls(params), params)
    gbuffer = engine.render_gbuffer(CAMERA, (33, 18))
    lighting = engine.light(hierarchy, gbuffer, params)
    shadows = engine.trace_shadow_rays(hierarchy, gbuffer, lighting, params)
    found = _core.limit_shadow_rays(engine._core_scene, hierarchy, gbuffer, lighting, params.to_core(), 3)

    picked = lighting.light >= 0
    samples = picked.sum() if estimator == "average" else (shadows.omega > 0).sum()
    assert samples > 500
    to_sun = (gbuffer.normal[..., 1] > 0).sum()
    to_point = ((np.float32([0.0, 1.5, 0.0]) - gbuffer.position) * gbuffer.normal).sum(-1) > 0
    to_spot = np.float32([0.0, 1.9, 0.0]) - gbuffer.position
    inside = to_spot[..., 1] / np.linalg.norm(to_spot, axis=-1) > np.cos(0.6)
    lit = inside & ((to_spot * gbuffer.normal).sum(-1) > 0)
    assert found["rays"] == pytest.approx(samples + to_sun + to_point.sum() + lit.sum(), abs=3)
    assert 0 < found["seconds"] < 10
