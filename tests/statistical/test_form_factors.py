"""One patch lights another: VPLs, brute force and the path tracer against form factors in closed form; t-tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import lab
from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import Lights
from lab.reference import Budget, brute_force, path_traced
from lab.scene.scene import Material, SunLight

from ..oracle_geometry.scenes import Array
from ..oracle_geometry.statistics import accept, welch_test
from ..oracle_geometry.two_patches import TwoPatches, cornered, facing

PATCHES = {"facing": facing(1.0), "near": facing(0.75), "cornered": cornered(0.25)}
LIT, SEEN = np.array([0.8, 0.5, 0.3]), np.array([0.6, 0.7, 0.9])
SUN = np.array([3.0, 2.0, 4.0])
SIZE = (20, 20)
SEEDS = 24


def grey(albedo: Array, emission: Array | None = None) -> Material:
    light = (0.0, 0.0, 0.0) if emission is None else tuple(emission.tolist())
    return Material("patch", tuple(albedo.tolist()), emission=light)


def lit_by_sun(t: TwoPatches) -> CpuEngine:
    return CpuEngine(t.scene(grey(LIT), grey(SEEN), suns=[SunLight(t.to_sun, tuple(SUN.tolist()))]))


def glowing(t: TwoPatches) -> tuple[CpuEngine, Array]:
    """The lit patch as a lamp of the same radiosity."""
    emission = SUN * LIT * t.cosine() / np.pi
    return CpuEngine(t.scene(grey(0 * LIT, emission), grey(SEEN))), emission


def lights_over(t: TwoPatches, seed: int) -> Lights:
    """Lambertian point lights over the lit patch, with the power that the sun gives it."""
    position = t.points_on_lit(np.random.default_rng(seed), 8)
    normal = np.cross(t.lit[1] - t.lit[0], t.lit[3] - t.lit[0])
    flux = np.tile(SUN * LIT * t.cosine() / len(position), (len(position), 1))
    rows = np.tile(normal / np.linalg.norm(normal), (len(position), 1))
    return Lights(position.astype(np.float32), flux.astype(np.float32), rows.astype(np.float32))


def by_light_list(t: TwoPatches, seed: int) -> Array:
    lights = lights_over(t, seed)
    engine = CpuEngine(t.scene(grey(LIT), grey(SEEN)))
    return brute_force(engine, t.camera, SIZE, Params(clamp_distance=0), lights=lights).indirect


def by_renderer(t: TwoPatches, seed: int) -> Array:
    """The hierarchy where nothing is approximated: only input lights are drawn."""
    scene = t.scene(grey(LIT), grey(SEEN), light_list=lights_over(t, seed))
    params = Params(alpha=1e6, clamp_distance=0, shadow_estimator="average", filter="none", seed=seed)
    return lab.render(scene, params, camera=t.camera, size=SIZE).image.indirect.astype(np.float64)


def by_vpls(t: TwoPatches, seed: int) -> Array:
    params = Params(vpls=6000, max_bounces=1, clamp_distance=0, seed=seed)
    return brute_force(lit_by_sun(t), t.camera, SIZE, params).indirect


def by_one_bounce(t: TwoPatches, seed: int) -> Array:
    params = Params(max_bounces=1, seed=seed)
    return path_traced(lit_by_sun(t), t.camera, SIZE, params, budget=Budget(spp=64)).indirect


def by_area_light(t: TwoPatches, seed: int) -> Array:
    return path_traced(glowing(t)[0], t.camera, SIZE, Params(seed=seed), budget=Budget(spp=64)).direct


WAYS: dict[str, Callable[[TwoPatches, int], Array]] = {
    "light list, brute force": by_light_list,
    "light list, renderer": by_renderer,
    "traced VPLs, brute force": by_vpls,
    "path tracer, one bounce": by_one_bounce,
    "path tracer, area light": by_area_light,
}


def points(t: TwoPatches) -> tuple[Array, Array]:
    """(H, W, 3) points of the picture, and (H, W) their form factors."""
    g = CpuEngine(t.scene(grey(LIT), grey(SEEN))).render_gbuffer(t.camera, SIZE)
    assert (g.depth > 0).all()
    position = g.position.astype(np.float64)
    return position, t.factors(position, g.normal.astype(np.float64))


def whole(t: TwoPatches) -> Array:
    """(3,) radiance of the seen patch for a form factor of 1."""
    return np.asarray(SUN * LIT * t.cosine() * SEEN / np.pi)


@pytest.mark.parametrize("patches", PATCHES)
@pytest.mark.parametrize("way", WAYS)
def test_a_patch_receives_its_form_factor(way: str, patches: str) -> None:
    t = PATCHES[patches]
    _, factor = points(t)
    assert factor.mean() == pytest.approx(t.factor, rel=2e-3), "the picture's pixels are an even grid on the patch"
    images = np.stack([WAYS[way](t, seed) for seed in range(1, SEEDS + 1)]) / whole(t)
    assert np.allclose(images[..., 0], images[..., 1], rtol=1e-3, atol=1e-5), "channels share their paths"
    found = images[..., 1]
    mean = found.mean(axis=(1, 2))
    assert accept(welch_test(found, factor[None], rounding=1e-5)), "each pixel"
    assert accept(welch_test(mean, [factor.mean()], rounding=1e-5)), "the whole patch"
    # The same statistic sees an error of 3 %, and a picture that is right on the whole but flat.
    assert not accept(welch_test(mean, [1.03 * factor.mean()]))
    assert not accept(welch_test(found, np.full((1, *factor.shape), factor.mean())))


@pytest.mark.parametrize("bounces", [1, 2, 3, 4])
def test_bounces_between_two_patches(bounces: int) -> None:
    """Light that went to the seen patch, back, and there again has bounced three times: it comes with max_bounces 3."""
    t = PATCHES["near"]
    position, factor = points(t)
    engine, scale = lit_by_sun(t), whole(t)[1]
    once, thrice = factor * scale, t.there_and_back(position, factor) * scale * LIT[1] * SEEN[1]
    assert 0.01 < thrice.mean() / once.mean() < 0.1
    found = np.stack([
        path_traced(engine, t.camera, SIZE, Params(max_bounces=bounces, seed=seed), budget=Budget(spp=512)).indirect
        for seed in range(1, SEEDS + 1)
    ])[..., 1]  # fmt: skip
    mean = found.mean(axis=(1, 2))
    right, wrong = (once, once + thrice) if bounces < 3 else (once + thrice, once)
    assert accept(welch_test(found, right[None], rounding=1e-4 * once.max()))
    assert accept(welch_test(mean, [right.mean()], rounding=1e-4 * once.max()))
    assert not accept(welch_test(mean, [wrong.mean()]))
