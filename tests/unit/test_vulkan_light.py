"""Stage light on the device: from the same records, what the CPU engine makes of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine, build_hierarchy
from lab.engine.vulkan.light import light
from lab.params import Params
from lab.records import GBuffer, Lighting
from lab.scene.load import load_scene

from ..oracle import cases
from ..oracle_geometry.grids import contributions, pick_weights
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.statistics import accept, chi_square
from ..oracle_geometry.trials import NORMAL, POSITION

VPLS = {"vpls": 2000, "picker": "race"}  # shaders take long to compile on the CPU: most cases share one


@pytest.fixture(scope="module")
def atrium(root: Any) -> tuple[CpuEngine, GBuffer, Any]:
    scene = load_scene(root / "scenes/atrium/scene.toml")
    engine = CpuEngine(scene)
    return engine, engine.render_gbuffer(scene.cameras[0], (101, 57)), engine.trace_vpls(Params(**VPLS))


def parting(got: Any, want: Any) -> float:
    """The share of pixels, of (.., H, W) counts, where they differ."""
    return float((got != want).reshape(-1, *want.shape[-2:]).any(axis=0).mean())


def assert_same_irradiance(got: Lighting, want: Lighting) -> None:
    mean = want.irradiance.mean()
    assert mean > 0
    np.testing.assert_allclose(got.irradiance, want.irradiance, rtol=1e-4, atol=1e-5 * mean)


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"alpha": 2.5, "lobe": "mean_energy", "falloff": "softened"},
        {"first_level": 1, "first_shadow_level": 2, "lobe": "mean", "importance": False},
        {"interleave": 2, "frame": 3},
        {"interleave": 4, "first_shadow_level": 1, "alpha": 0.6},
        {"interleave": 8, "deal_all": True, "clamp_distance": 0.0},
        {"alpha": 1e4, "levels": 1},
        {"first_shadow_level": 12, "seed": 9},
        {"picker": "reservoir", "interleave": 4, "first_shadow_level": 1},
        {"picker": "reservoir", "importance": False, "alpha": 2.0, "shadow_samples": 4},
    ],
    ids=str,
)
def test_light_is_the_cpus(gpu: Any, atrium: Any, settings: dict[str, Any]) -> None:
    engine, gbuffer, lights = atrium
    params = Params(**(VPLS | settings))
    hierarchy = engine.build_hierarchy(lights, params)
    want = engine.light(hierarchy, gbuffer, params)
    got = light(gpu, hierarchy, gbuffer, params, engine.scene_radius, counts=True)
    assert_same_irradiance(got, want)
    assert got.overdraw is not None and got.lights_used is not None
    assert got.overdraw.shape == want.overdraw.shape
    assert parting(got.overdraw, want.overdraw) < 1e-4
    assert parting(got.lights_used, want.lights_used) < 2e-4  # one pixel, where rounding decides
    np.testing.assert_allclose(got.weight_sum, want.weight_sum, rtol=1e-4, atol=1e-5 * want.weight_sum.mean())
    assert np.mean(got.light != want.light) < 1e-3
    same = got.light == want.light
    np.testing.assert_allclose(got.target_weight[same], want.target_weight[same], rtol=1e-3, atol=1e-6)
    assert got.visited >= 0.5 * want.visited


def test_a_soft_receiver_is_the_cpus(gpu: Any, atrium: Any) -> None:
    """But for lights far below the horizon: what little they send there falls out of float32's range at two places."""
    engine, gbuffer, lights = atrium
    params = Params(**VPLS, receiver="soft", alpha=2)
    hierarchy = engine.build_hierarchy(lights, params)
    want = engine.light(hierarchy, gbuffer, params)
    got = light(gpu, hierarchy, gbuffer, params, engine.scene_radius, counts=True)
    assert_same_irradiance(got, want)
    np.testing.assert_array_equal(got.overdraw, want.overdraw)
    few = np.abs(got.counts()[1].astype(int) - want.counts()[1])
    assert few.max() <= 3 and few.mean() < 1e-2
    assert np.mean(got.light != want.light) < 1e-3


@pytest.mark.parametrize("samples", [0, 12])
def test_what_is_culled_and_how_samples_are_dealt_to_runs_changes_nothing(gpu: Any, atrium: Any, samples: int) -> None:
    engine, gbuffer, lights = atrium
    params = Params(**VPLS, shadow_samples=samples, interleave=2)
    hierarchy = engine.build_hierarchy(lights, params)
    want = engine.light(hierarchy, gbuffer, params, counts=False)
    counted = light(gpu, hierarchy, gbuffer, params.replace(shadow_samples=4), engine.scene_radius, counts=True)
    got = light(gpu, hierarchy, gbuffer, params, engine.scene_radius, counts=False)
    assert got.overdraw is None and got.lights_used is None
    np.testing.assert_array_equal(got.irradiance, counted.irradiance)
    assert got.light.shape == want.light.shape
    assert np.mean(got.light != want.light) < 1e-3 if samples else got.weight_sum.max() == 0


@pytest.mark.parametrize("name", ["outlier", "tiny_scene", "huge_scene", "far_away", "on_faces", "without_normals"])
def test_scenes_of_any_size_and_place(gpu: Any, name: str) -> None:
    lights = cases.CLOUDS[name]()
    params = Params(**VPLS, levels=4)
    hierarchy = build_hierarchy(lights, params)
    rng = np.random.default_rng(3)
    spread = 0.05 * np.median(np.ptp(lights.position, axis=0))
    position = lights.position[rng.integers(0, len(lights), 150)] + rng.normal(0, spread, (150, 3))
    for shape in ((1, 150), (10, 15)):
        gbuffer = cases.as_gbuffer(position.astype(np.float32), cases.unit_vectors(rng, 150), shape)
        engine = CpuEngine(occluded_room(lights))
        want = engine.light(hierarchy, gbuffer, params)
        got = light(gpu, hierarchy, gbuffer, params, engine.scene_radius, counts=True)
        assert_same_irradiance(got, want)
        np.testing.assert_array_equal(got.overdraw, want.overdraw)


def test_background_stays_dark(gpu: Any, atrium: Any) -> None:
    engine, gbuffer, lights = atrium
    hole = np.zeros_like(gbuffer.depth)
    hole[20:40, 30:70] = 1
    planes = {n: getattr(gbuffer, n) * (1 - hole[..., None]) for n in ("position", "normal", "geometric_normal")}
    params = Params(**VPLS)
    hierarchy = engine.build_hierarchy(lights, params)
    cut = GBuffer(
        **planes, albedo=gbuffer.albedo, emission=gbuffer.emission, depth=gbuffer.depth * (1 - hole), pixel_angle=0.01
    )
    got = light(gpu, hierarchy, cut, params, engine.scene_radius, counts=True)
    whole = light(gpu, hierarchy, gbuffer, params, engine.scene_radius, counts=True)
    dark = hole > 0
    assert not got.irradiance[dark].any() and not got.weight_sum[dark].any() and not got.target_weight[dark].any()
    assert (got.light[dark] == -1).all()
    assert not got.counts()[0][:, dark].any() and not got.counts()[1][:, dark].any()
    np.testing.assert_array_equal(got.irradiance[~dark], whole.irradiance[~dark])
    np.testing.assert_array_equal(got.light[~dark], whole.light[~dark])


@pytest.mark.parametrize("importance, first_shadow_level", [(True, 0), (False, 2)])
def test_reservoirs_follow_the_target_weights(gpu: Any, importance: bool, first_shadow_level: int) -> None:
    """4,000 draws of four independent samples at six receivers."""
    lights = wall_lights(3, 60)
    engine = CpuEngine(occluded_room(lights))
    params = Params(levels=3, alpha=0.7, shadow_samples=4, importance=importance, first_shadow_level=first_shadow_level)
    hierarchy = engine.build_hierarchy(lights, params)
    copies = (1000, 1, 1)
    gbuffer = points_as_gbuffer(np.tile(POSITION, copies), np.tile(NORMAL, copies))
    frames = [
        light(gpu, hierarchy, gbuffer, params.replace(frame=frame), engine.scene_radius, counts=False)
        for frame in range(4)
    ]
    picks = np.concatenate([frame.light for frame in frames])
    one = points_as_gbuffer(POSITION[None], NORMAL[None])
    f = pick_weights(
        hierarchy,
        contributions(
            hierarchy, one.position[0].astype(float), one.normal[0].astype(float), params, engine.scene_radius
        ),
        params,
    )
    np.testing.assert_allclose(frames[0].weight_sum[0], f.sum(axis=1), rtol=1e-4)
    many = len(hierarchy.position)
    p_values = [chi_square(np.bincount(picks[:, p, s], minlength=many), f[p]) for p in range(len(f)) for s in range(4)]
    assert accept(p_values)
    wrong = f * np.where(np.arange(many) % 2, 1.3, 1.0)
    assert not accept([chi_square(np.bincount(picks[:, p].ravel(), minlength=many), wrong[p]) for p in range(len(f))])
    pairs = picks[:, 0, 0] * many + picks[:, 0, 1]  # independent of each other, too
    assert accept([chi_square(np.bincount(pairs, minlength=many * many), np.outer(f[0], f[0]).ravel())])
