"""The path tracer against closed forms, and against another one in float64 numpy."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest

from lab import _core
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.reference import Budget, Reference, brute_force, path_traced
from lab.scene.scene import Camera, Material, PointLight, Scene, SpotLight, SunLight

from ..oracle.path_tracer import PathTracer, Vertex
from ..oracle_geometry.direct import lit
from ..oracle_geometry.scenes import Array, box, occluded_room, quad, scene_of, wall_lights
from ..oracle_geometry.statistics import accept, block_means, welch_test, z_test

CAMERA = Camera("inside", (1.6, 1.2, 1.8), (-0.3, 0.6, -0.4), fov_y_deg=80.0)
SIZE = (12, 8)
SUN = SunLight((0.48, 0.8, 0.36), (3.0, 2.0, 1.0))
LAMP = quad((-0.5, 1.95, -0.5), (0.5, 1.95, -0.5), (0.5, 1.95, 0.5), (-0.5, 1.95, 0.5), 3)


def lamp_room(**more: object) -> Scene:
    room = occluded_room(**more)
    return dataclasses.replace(
        room,
        meshes=[*room.meshes, LAMP],
        materials=[*room.materials, Material("lamp", (0.2, 0.2, 0.2), emission=(4.0, 3.0, 2.0))],
    )


SPOT = SpotLight((0.0, 1.9, 1.0), (-0.2, -1.0, -0.6), (5.0, 6.0, 7.0), 0.3, 0.9)
SCENES: dict[str, Scene] = {
    "points and a spot": occluded_room(points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 4.0))], spots=[SPOT]),
    "lamp": lamp_room(),
    "sun": dataclasses.replace(
        occluded_room(suns=[SUN]),
        meshes=[
            quad((-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)),
            quad((-2, 0, -2), (2, 0, -2), (2, 2, -2), (-2, 2, -2)),
            box((-0.9, 0, -0.8), (-0.4, 1.4, -0.2), 1),
        ],
    ),
    "light list": occluded_room(wall_lights(4, 5)),
}


@cache
def oracle(name: str, bounces: int, copies: int = 120) -> tuple[Array, Array]:
    """(copies, H, W) direct and indirect luminance-like means of three channels."""
    scene = SCENES[name]
    g = CpuEngine(scene).render_gbuffer(CAMERA, SIZE)
    hit = g.depth > 0
    tracer = PathTracer(scene, 11)
    first = Vertex(*(x[hit].astype(np.float64) for x in (g.position, g.geometric_normal, g.albedo)))
    found = np.zeros((2, copies, *hit.shape))
    for i in range(copies):
        for layer, values in enumerate(tracer.trace(first, bounces)):
            found[layer, i][hit] = values.mean(axis=1)
    found[0] += g.emission.mean(axis=-1)
    return found[0], found[1]


def traced(scene: Scene, spp: int = 64, pixel: str = "centre", camera: Camera = CAMERA, **settings: Any) -> Reference:
    return path_traced(CpuEngine(scene), camera, SIZE, Params(**settings), budget=Budget(spp=spp), pixel=pixel)


@pytest.mark.parametrize(
    ("name", "bounces"), [("points and a spot", 3), ("lamp", 1), ("lamp", 2), ("sun", 2), ("light list", 1)]
)
def test_as_in_numpy(name: str, bounces: int) -> None:
    direct, indirect = oracle(name, bounces)
    engine = CpuEngine(SCENES[name])
    runs = [
        path_traced(engine, CAMERA, SIZE, Params(max_bounces=bounces, seed=seed), budget=Budget(spp=64))
        for seed in range(1, 25)
    ]
    for wanted, layer in ((direct, "direct"), (indirect, "indirect")):
        found = np.stack([getattr(run, layer).mean(axis=-1) for run in runs])
        few = block_means(wanted, 4)
        assert accept(welch_test(block_means(found, 4), few, rounding=2e-4 * wanted.mean())), layer
        assert accept(welch_test(found.mean(axis=(1, 2)), wanted.mean(axis=(1, 2)), rounding=1e-4 * wanted.mean()))
        # In the open little light bounces, and the oracle is noisier.
        wrong = (1.4 if name == "sun" else 1.1) * found.mean(axis=(1, 2))
        assert not accept(welch_test(wrong, wanted.mean(axis=(1, 2)))), "an error would be seen"
    one_more = np.stack([
        path_traced(engine, CAMERA, SIZE, Params(max_bounces=bounces + 1, seed=seed), budget=Budget(spp=64)).indirect
        for seed in range(1, 25)
    ]).mean(axis=(1, 2, 3))  # fmt: skip
    if name != "sun":
        assert not accept(welch_test(one_more, indirect.mean(axis=(1, 2)))), "another number of bounces would be seen"


# --- closed forms ----------------------------------------------------------------------------------------------------

FLOOR = quad((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))
ABOVE = Camera("above", (0.0, 3.0, 2.0), (0.0, 0.0, 0.0), fov_y_deg=40.0)


def test_a_sun_on_a_floor_is_exact() -> None:
    scene = scene_of([FLOOR], [Material("floor", (0.6, 0.5, 0.4))], suns=[SUN])
    found = traced(scene, 4, camera=ABOVE)
    wanted = np.array(SUN.irradiance) * 0.8 * np.array([0.6, 0.5, 0.4]) / np.pi
    np.testing.assert_allclose(found.direct, np.broadcast_to(wanted, found.direct.shape), rtol=1e-5)
    assert not found.indirect.any() and not found.direct_variance.any() and not found.colour_variance.any()


def test_nothing_seen_is_black() -> None:
    scene = scene_of([FLOOR], suns=[SUN], background=(1.0, 2.0, 3.0))
    found = traced(scene, 2, camera=Camera("up", (0.0, 1.0, 0.0), (0.0, 2.0, 0.1)))
    assert not found.colour.any()


@pytest.mark.parametrize("count", [3, 16, 17, 200])
def test_one_of_many_lights_stands_for_all(count: int) -> None:
    """Resampling: among few candidates one gets the ray. The sum over all lights, each with its own ray, is exact."""
    rng = np.random.default_rng(count)
    points = [
        PointLight(tuple(p), tuple(i))
        for p, i in zip(rng.uniform((-1.8, 0.4, -1.8), (1.8, 1.9, 1.8), (count, 3)), rng.gamma(0.5, 1, (count, 3)),
                        strict=True)
    ]  # fmt: skip
    scene = occluded_room(points=points)
    engine = CpuEngine(scene)
    g = engine.render_gbuffer(CAMERA, SIZE)
    lifted = g.position.reshape(-1, 3) + 2e-5 * g.geometric_normal.reshape(-1, 3).astype(np.float64)
    wanted, sure = np.zeros((lifted.shape[0], 3)), np.ones(len(lifted), bool)
    for point in points:
        arriving, known = lit(scene, point, g.position.reshape(-1, 3), g.normal.reshape(-1, 3), lifted, ends=1e-3)
        wanted += arriving
        sure &= known
    wanted *= g.albedo.reshape(-1, 3) / np.pi
    assert sure.mean() > 0.9
    found = np.stack([traced(scene, 16, seed=s, max_bounces=1).direct.reshape(-1, 3) for s in range(200)])[:, sure]
    for c in range(3):
        assert accept(z_test(found[..., c], wanted[sure, c], rounding=2e-4 * wanted.max()))
    whole = found.sum(axis=(1, 2))
    assert accept(welch_test(whole, [wanted[sure].sum()]))
    assert not accept(welch_test(1.01 * whole, [wanted[sure].sum()])), "the test would not see an error of 1 %"


def test_a_light_list_is_direct_light() -> None:
    """As the sum over the list without a clamp has it."""
    engine = CpuEngine(occluded_room(wall_lights(8, 60)))
    wanted = brute_force(engine, CAMERA, SIZE, Params(clamp_distance=0), budget=Budget(spp=64))
    assert wanted.exact
    found = np.stack([
        path_traced(engine, CAMERA, SIZE, Params(seed=seed), budget=Budget(spp=32)).direct for seed in range(1, 81)
    ]).sum(axis=-1)  # fmt: skip
    exact = wanted.indirect.sum(axis=-1)
    assert accept(welch_test(block_means(found, 2), block_means(exact[None], 2), rounding=1e-4 * exact.mean()))
    assert not accept(welch_test(found.mean(axis=(1, 2)), [0.97 * exact.mean()]))


# --- pixels ----------------------------------------------------------------------------------------------------------


def half_lit() -> tuple[CpuEngine, Array]:
    """A glowing quad that covers pixels in part; the share of each pixel, exactly."""
    camera_height, width = 4.0, 0.53
    material = Material("glow", (0.0, 0.0, 0.0), emission=(1.0, 2.0, 3.0))
    glow = quad((-width, 0, 0.31), (width, 0, 0.31), (width, 0, -0.77), (-width, 0, -0.77))
    engine = CpuEngine(scene_of([glow], [material]))
    pitch = 2 * camera_height * np.tan(np.radians(40) / 2) / SIZE[1]
    x = (np.arange(SIZE[0] + 1) - SIZE[0] / 2) * pitch
    z = (np.arange(SIZE[1] + 1) - SIZE[1] / 2) * pitch

    def covered(edges: Array, low: float, high: float) -> Array:
        return np.maximum(0, np.minimum(edges[1:], high) - np.maximum(edges[:-1], low)) / pitch

    return engine, covered(z, -0.77, 0.31)[:, None] * covered(x, -width, width)[None]


def test_an_area_pixel_is_the_mean_over_its_area() -> None:
    engine, share = half_lit()
    assert ((share > 0.05) & (share < 0.95)).sum() > 8
    camera = Camera("above", (0.0, 4.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), fov_y_deg=40.0)
    runs = [
        path_traced(engine, camera, SIZE, Params(seed=seed), budget=Budget(spp=64), pixel="area").direct[..., 1]
        for seed in range(1, 41)
    ]
    assert accept(welch_test(np.stack(runs), 2 * share[None], rounding=1e-6))
    centre = path_traced(engine, camera, SIZE, Params(), budget=Budget(spp=4)).direct[..., 1]
    assert set(np.unique(centre)) == {0.0, 2.0}
    assert not accept(welch_test(np.stack(runs), centre[None]))


def test_pixel_is_checked() -> None:
    with pytest.raises(LabError, match=r"centre \| area"):
        traced(SCENES["lamp"], pixel="corner")


# --- samples ---------------------------------------------------------------------------------------------------------


def test_error_bars_are_those_of_many_runs() -> None:
    """The variance that one run reports is that of the mean over many: chi-square in the mean over blocks."""
    engine = CpuEngine(SCENES["lamp"])
    runs = [path_traced(engine, CAMERA, SIZE, Params(seed=seed), budget=Budget(spp=64)) for seed in range(1, 81)]
    for layer in ("direct", "indirect", "colour"):
        values = np.stack([getattr(run, layer) for run in runs])
        reported = np.mean([getattr(run, f"{layer}_variance") for run in runs])
        assert values.var(axis=0, ddof=1).mean() == pytest.approx(reported, rel=0.1), layer
    both = np.mean([run.direct_variance + run.indirect_variance for run in runs])
    colour = np.mean([run.colour_variance for run in runs])
    assert colour == pytest.approx(both, rel=0.3) and colour != both, "the layers share their paths"


def test_samples_do_not_depend_on_how_they_are_split() -> None:
    engine = CpuEngine(SCENES["lamp"])
    g = engine.render_gbuffer(CAMERA, SIZE)
    whole = engine.trace_paths(g, None, 0, 12, Params())
    parts = [engine.trace_paths(g, None, first, count, Params()) for first, count in ((0, 5), (5, 1), (6, 6))]
    for name, sums in whole.items():
        np.testing.assert_allclose(sum(part[name] for part in parts), sums, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("pixel", ["centre", "area"])
def test_any_number_of_threads(pixel: str) -> None:
    before = _core.info()["threads"]
    try:
        found = []
        for threads in (1, 2, 3):
            _core.set_threads(threads)
            found.append(traced(SCENES["lamp"], 8, pixel))
    finally:
        _core.set_threads(before)
    for other in found[1:]:
        for layer in ("direct", "indirect", "colour_variance"):
            assert np.array_equal(getattr(found[0], layer), getattr(other, layer))


def test_seeds_differ_and_repeat() -> None:
    a, b, c = (traced(SCENES["lamp"], 4, seed=seed).colour for seed in (1, 1, 2))
    assert np.array_equal(a, b) and not np.array_equal(a, c)


def test_one_sample_has_no_error_bar() -> None:
    found = traced(SCENES["lamp"], 1)
    assert np.isinf(found.indirect_variance[found.indirect > 0]).all() and np.isinf(found.relative_error)
