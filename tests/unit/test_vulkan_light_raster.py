"""Raster lighting: from the same records, what tiled lighting makes of them; and its samples under every lock."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.records import Lighting, Lights
from lab.scene.scene import Camera

from ..oracle_geometry.grids import contributions, pick_weights
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.statistics import accept, chi_square, same_distribution
from ..oracle_geometry.trials import NORMAL, POSITION
from .command_line import refused
from .vulkan_scenes import engines

RACE = {"vpls": 1500, "picker": "race"}
SIZE = (65, 37)  # no multiple of any tile


def parting(got: Any, want: Any) -> float:
    """The share of pixels, of (.., H, W) counts, where they differ."""
    return float((got != want).reshape(-1, *want.shape[-2:]).any(axis=0).mean())


def both(
    gpu: Any, params: Params, camera: Camera | None = None, counts: bool = True, **raster_settings: Any
) -> tuple[Lighting, Lighting]:
    """The atrium lit by raster and tiled lighting, from one hierarchy and G-buffer."""
    vulkan, cpu = engines(gpu, "atrium")
    hierarchy = cpu.build_hierarchy(cpu.trace_vpls(params), params)
    gbuffer = vulkan.render_gbuffer(camera or cpu.scene.cameras[0], SIZE)
    raster = vulkan.light(hierarchy, gbuffer, params.replace(lighting="raster", **raster_settings), counts)
    return raster, vulkan.light(hierarchy, gbuffer, params, True)


def assert_same_light(got: Lighting, want: Lighting) -> None:
    mean = want.irradiance.mean()
    assert mean > 0
    np.testing.assert_allclose(got.irradiance, want.irradiance, rtol=1e-4, atol=1e-5 * mean)
    np.testing.assert_allclose(got.weight_sum, want.weight_sum, rtol=1e-4, atol=1e-5 * want.weight_sum.mean())


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"interleave": 4, "alpha": 0.6, "frame": 3},
        {"first_level": 1, "first_shadow_level": 2, "lobe": "mean", "importance": False},
        {"interleave": 8, "deal_all": True, "first_shadow_level": 12, "shadow_samples": 9},
        {"alpha": 1e4, "levels": 1, "vpls": 200},
    ],
    ids=str,
)
def test_raster_lighting_is_tiled_lighting(gpu: Any, settings: dict[str, Any]) -> None:
    params = Params(**RACE | settings)
    got, want = both(gpu, params)
    assert_same_light(got, want)
    assert parting(got.counts()[0], want.counts()[0]) < 1e-4
    assert parting(got.counts()[1], want.counts()[1]) < 1e-3  # one pixel, where rounding decides
    assert want.fragments is None and got.fragments is not None
    assert (got.fragments >= got.counts()[0].sum(axis=0)).all()
    assert got.fragments.max() <= got.visited == got.fragments.sum()
    assert (want.light >= 0).mean() > 0.5
    assert np.mean(got.light != want.light) < 1e-3
    same = got.light == want.light
    np.testing.assert_allclose(got.target_weight[same], want.target_weight[same], rtol=1e-4)


def test_no_pixel_in_a_cube_is_missed_wherever_the_camera_is(gpu: Any) -> None:
    """Inside of hundreds of cubes, some of whose faces all but touch the eye, and looking along their edges."""
    _, cpu = engines(gpu, "atrium")
    base, rng = cpu.scene.cameras[0], np.random.default_rng(5)
    params = Params(**RACE | {"vpls": 600, "alpha": 0.7})
    hierarchy = cpu.build_hierarchy(cpu.trace_vpls(params), params)
    lowest, highest = hierarchy.position.min(axis=0), hierarchy.position.max(axis=0)
    # Cubes are drawn a little larger than they are: these eyes lie within 1e-5 of a drawn face.
    half_edge = 2 * 0.7 * hierarchy.cell_size * (1.001 + 0.06 * 2 * np.tan(np.deg2rad(base.fov_y_deg) / 2) / SIZE[1])
    faces = hierarchy.position.copy()
    faces[:, 0] += np.repeat(half_edge, np.diff(hierarchy.offset))
    inside = np.flatnonzero(((faces > lowest) & (faces < highest)).all(axis=1))
    assert len(inside) > 20
    eyes = [*faces[inside[:: len(inside) // 4]][:4], *rng.uniform(lowest, highest, (4, 3))]
    for i, eye in enumerate(eyes):
        ahead = np.eye(3)[i % 3] * (-1) ** i if i < 4 else rng.normal(size=3)
        up = np.eye(3)[(i + 1) % 3]
        camera = Camera("c", tuple(map(float, eye)), tuple(map(float, eye + ahead)), tuple(up), base.fov_y_deg)
        got, want = both(gpu, params, camera)
        assert want.counts()[0].sum() > 0
        assert_same_light(got, want)
        assert parting(got.counts()[0], want.counts()[0]) < 1e-4


def test_points_closer_than_the_unit_of_depth(gpu: Any) -> None:
    """An eye close above a light on a wall sees that light's small cube from the inside."""
    vulkan, cpu = engines(gpu, "atrium")
    params = Params(**RACE, alpha=0.004)
    lights = cpu.trace_vpls(params)
    assert lights.normal is not None
    at, normal = lights.position[40].astype(float), lights.normal[40].astype(float)
    eye = at + 2e-4 * cpu.scene_radius * normal
    camera = Camera("c", tuple(eye), tuple(at), tuple(np.roll(normal, 1)), 60.0)
    assert vulkan.render_gbuffer(camera, SIZE).depth.max() < 1e-3 * cpu.scene_radius
    got, want = both(gpu, params, camera)
    assert want.counts()[0][0].mean() > 0.5
    assert_same_light(got, want)
    np.testing.assert_array_equal(got.counts()[0], want.counts()[0])


@pytest.mark.parametrize("scale", [0.001, 1.0, 100.0])
def test_lights_of_any_size_and_place(gpu: Any, scale: float) -> None:
    """A user's own, that have nothing to do with the scene: in a corner of it, around it, and far outside."""
    vulkan, cpu = engines(gpu, "atrium")
    params = Params(**RACE, interleave=2)
    gbuffer = vulkan.render_gbuffer(cpu.scene.cameras[0], SIZE)
    middle = gbuffer.position[SIZE[1] // 2, SIZE[0] // 2]
    rng = np.random.default_rng(7)
    position = middle + scale * cpu.scene_radius * rng.normal(size=(150, 3))
    hierarchy = cpu.build_hierarchy(Lights(position.astype(np.float32), np.ones((150, 3), np.float32)), params)
    want = vulkan.light(hierarchy, gbuffer, params)
    got = vulkan.light(hierarchy, gbuffer, params.replace(lighting="raster"))
    assert_same_light(got, want)
    assert parting(got.counts()[0], want.counts()[0]) < 1e-4
    assert np.mean(got.light != want.light) < 1e-3


def test_what_is_counted_changes_nothing_and_what_is_behind_is_not_drawn(gpu: Any) -> None:
    params = Params(**RACE, alpha=0.7)
    counted, _ = both(gpu, params)
    got, _ = both(gpu, params, counts=False)
    assert got.overdraw is None and got.fragments is None and got.visited == 0
    for name in ("irradiance", "light", "target_weight", "weight_sum"):
        np.testing.assert_array_equal(getattr(got, name), getattr(counted, name))
    # The top's lights reach all that is seen; the other cubes are drawn where they are, and in front of the scene.
    assert counted.fragments is not None and counted.overdraw is not None
    _, cpu = engines(gpu, "atrium")
    lights = len(cpu.build_hierarchy(cpu.trace_vpls(params), params).position)
    assert counted.fragments.mean() < 0.5 * lights
    assert counted.fragments.mean() < 4 * counted.overdraw.sum(axis=0).mean()


def test_what_is_not_seen_stays_dark(gpu: Any) -> None:
    vulkan, cpu = engines(gpu, "gallery")
    params = Params(**RACE, lighting="raster")
    eye, target = np.float32([0, 30, 0.3]), (0.0, 0.0, 0.0)
    gbuffer = vulkan.render_gbuffer(Camera("above", tuple(map(float, eye)), target, fov_y_deg=10.0), SIZE)
    hole = gbuffer.depth == 0
    assert 0.2 < hole.mean() < 0.9
    got = vulkan.light(cpu.build_hierarchy(cpu.trace_vpls(params), params), gbuffer, params)
    assert not got.irradiance[hole].any() and not got.weight_sum[hole].any() and (got.light[hole] == -1).all()
    assert got.fragments is not None and not got.fragments[hole].any() and got.fragments[~hole].any()


def trials(gpu: Any, params: Params) -> tuple[Any, Any, Any]:
    """Picks at six receivers, and their exact target weights: each pixel of a picture is one of the receivers.

    Every cube must fill the view, so that it does not matter where the pixels say that their points are.
    """
    from lab.engine.vulkan.gbuffer import gbuffer_parts
    from lab.engine.vulkan.light_raster import RasterLighter
    from lab.engine.vulkan.records import device_record

    lights = wall_lights(3, 60)
    engine = CpuEngine(occluded_room(lights))
    hierarchy = engine.build_hierarchy(lights, params)
    copies = (600, 1, 1)
    plain = points_as_gbuffer(np.tile(POSITION, copies), np.tile(NORMAL, copies))
    view = gbuffer_parts(gpu, plain)
    axes = {"eye": (0.0, 0.0, 0.0), "forward": (0.0, 0.0, -1.0), "right": (1.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0)}
    camera = axes | {"step": 0.001, "half_width": 3.0, "half_height": 300.0}
    view = dataclasses.replace(view, camera=camera, reach=10.0)
    fields = {field.name: (lambda name=field.name: getattr(plain, name)) for field in dataclasses.fields(plain)}
    gbuffer = device_record(type(plain), view, fields)
    lighter = RasterLighter(gpu)
    found = [
        lighter.light(hierarchy, gbuffer, params.replace(frame=frame), engine.scene_radius, counts=False)
        for frame in range(4)
    ]
    one = points_as_gbuffer(POSITION[None], NORMAL[None])
    at, normal = one.position[0].astype(float), one.normal[0].astype(float)
    f = pick_weights(hierarchy, contributions(hierarchy, at, normal, params, engine.scene_radius), params)
    np.testing.assert_allclose(found[0].weight_sum[0], f.sum(axis=1), rtol=1e-4)
    picks = np.concatenate([lighting.light for lighting in found])
    weights = np.concatenate([lighting.target_weight for lighting in found])
    rows = np.arange(len(POSITION))[None, :, None]
    np.testing.assert_allclose(weights, f[rows, picks], rtol=1e-3)
    return picks, f, hierarchy


@pytest.mark.parametrize("importance", [True, False])
@pytest.mark.parametrize("locks", ["locked", "atomic_race"])
def test_samples_follow_the_target_weights(gpu: Any, locks: str, importance: bool) -> None:
    """2,400 draws of five independent samples at six receivers."""
    params = Params(
        levels=1, alpha=50.0, shadow_samples=5, lighting="raster", reservoir_locks=locks, importance=importance
    )
    picks, f, hierarchy = trials(gpu, params)
    assert ((f > 0).sum(axis=1) > 15).all()
    many = len(hierarchy.position)
    counts = [[np.bincount(picks[:, p, s], minlength=many) for s in range(5)] for p in range(len(f))]
    assert accept([chi_square(counts[p][s], f[p]) for p in range(len(f)) for s in range(5)])
    wrong = f * np.where(np.arange(many) % 2, 1.3, 1.0)
    assert not accept([chi_square(sum(counts[p]), wrong[p]) for p in range(len(f))])
    pairs = picks[:, 0, 0] * many + picks[:, 0, 4]  # of two hashes; independent of each other, too
    assert accept([chi_square(np.bincount(pairs, minlength=many * many), np.outer(f[0], f[0]).ravel())])


@pytest.mark.parametrize("locks", ["none", "locked"])
def test_levels_that_are_passed_over_are_picked_from_where_the_others_give_nothing(gpu: Any, locks: str) -> None:
    """Lights come finest first, so picks of the passed-over levels must give way to the others."""
    params = Params(**RACE, first_shadow_level=2, alpha=1.5)
    got, want = both(gpu, params, picker="reservoir", reservoir_locks=locks, counts=False)
    assert_same_light(got, want)
    _, cpu = engines(gpu, "atrium")
    first = cpu.build_hierarchy(cpu.trace_vpls(params), params).offset[2]
    np.testing.assert_array_equal((got.light >= first), (want.light >= first))
    assert (want.light >= first).mean() > 0.5
    counts = [np.bincount(lighting.light[lighting.light >= first] % 61, minlength=61) for lighting in (got, want)]
    assert accept([same_distribution(*counts)])


def test_all_levels_where_the_wanted_ones_give_nothing(gpu: Any) -> None:
    """With wide blending all light comes from the finest level."""
    for locks in ("locked", "atomic_race"):
        params = Params(
            first_shadow_level=1, levels=1, alpha=50.0, shadow_samples=2, lighting="raster", reservoir_locks=locks
        )
        picks, f, hierarchy = trials(gpu, params)
        assert (picks >= 0).all() and (picks < hierarchy.offset[1]).all()
        counts = [np.bincount(picks[:, p].ravel(), minlength=f.shape[1]) for p in range(len(f))]
        assert accept([chi_square(count, row) for count, row in zip(counts, f, strict=True)])


def test_refusals(gpu: Any, quads: Path, empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from lab.engine.vulkan.light_raster import check_size

    vulkan, cpu = engines(gpu, "atrium")
    params = Params(vpls=50, lighting="raster")
    hierarchy = cpu.build_hierarchy(cpu.trace_vpls(params), params)
    points = cpu.render_gbuffer(cpu.scene.cameras[0], (16, 9))
    with pytest.raises(LabError, match=r"engine cpu has no rasteriser.*tiled.*--engine vulkan"):
        cpu.light(hierarchy, points, params)
    with pytest.raises(LabError, match=r"does not come with.*render_gbuffer"):
        vulkan.light(hierarchy, points, params)
    with pytest.raises(LabError, match=r"reservoir_locks=locked.*atomic_race.*picker=reservoir"):
        vulkan.light(hierarchy, points, params.replace(picker="race", reservoir_locks="locked"))
    with pytest.raises(LabError, match=r"64 shadow samples of 16384x1024 pixels take 8.0 GiB"):
        check_size((16384, 1024), params.replace(shadow_samples=64))
    check_size((16384, 512), params.replace(shadow_samples=64, reservoir_locks="none"))
    assert "has no rasteriser" in refused(["render", str(quads), "--set", "lighting=raster"], capsys)
