"""The sum over all lights against the same in float64 numpy; drawn lights: no bias, and honest error bars."""

from __future__ import annotations

import dataclasses
import sys
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import stats

from lab import _core
from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import GBuffer, Lights
from lab.reference import Budget, brute_force
from lab.reference.brute_force import BruteForce, in_morton_order
from lab.scene.scene import Camera

from ..oracle.brute_force import brute_force as oracle
from ..oracle_geometry.grids import LUMINANCE
from ..oracle_geometry.scenes import Array, occluded_room, tilted, wall_lights
from ..oracle_geometry.statistics import SIGNIFICANCE, accept, welch_test

CAMERA = Camera("inside", (1.6, 1.2, 1.8), (-0.3, 0.6, -0.4), fov_y_deg=80.0)
SIZE = (12, 8)
LIGHTS = wall_lights(5, 300)
ROOM = CpuEngine(occluded_room(LIGHTS))


@cache
def gbuffer() -> GBuffer:
    return tilted(ROOM.render_gbuffer(CAMERA, SIZE))


def summed(lights: Lights, draws: int, pass_number: int = 0, engine: CpuEngine = ROOM, **settings: Any) -> Any:
    return engine.brute_force(lights, gbuffer(), (0, SIZE[1]), Params(**settings), draws=draws, pass_number=pass_number)


FALLOFFS = [("clamped", 0.0), ("clamped", 0.01), ("clamped", 0.5), ("softened", 0.01), ("softened", 0.5)]


@pytest.mark.parametrize("oriented", [0.0, 0.7, 1.0])
@pytest.mark.parametrize(("falloff", "clamp"), FALLOFFS)
def test_every_light(falloff: str, clamp: float, oriented: float) -> None:
    lights = wall_lights(6, 200, oriented)
    params = Params(falloff=falloff, clamp_distance=clamp)
    found = summed(lights, 0, falloff=falloff, clamp_distance=clamp)
    shadowed, unshadowed = (oracle(ROOM, gbuffer(), lights, params, shadows=s) for s in (True, False))
    np.testing.assert_allclose(found["unshadowed"], unshadowed, rtol=3e-5, atol=1e-7 * unshadowed.max())
    np.testing.assert_allclose(found["irradiance"], shadowed, rtol=3e-5, atol=1e-7 * shadowed.max())
    assert not found["variance"].any() and found["exact_pixels"] == gbuffer().depth.size
    assert 0.2 < shadowed.sum() / unshadowed.sum() < 0.95, "some light is blocked, some is not"


@pytest.mark.parametrize("other", [{"falloff": "softened"}, {"clamp_distance": 0.4}])
def test_the_falloff_matters(other: dict[str, Any]) -> None:
    assert not np.allclose(summed(LIGHTS, 0, **other)["irradiance"], summed(LIGHTS, 0)["irradiance"], rtol=1e-2)


def test_coincident_lights_add_up() -> None:
    row = Lights(LIGHTS.position[:1], LIGHTS.flux[:1], LIGHTS.normal[:1])
    many = Lights(*(np.repeat(rows, 300, axis=0) for rows in (row.position, row.flux / 300, row.normal)))
    one = summed(row, 0)["irradiance"]
    assert one.any()
    np.testing.assert_allclose(summed(many, 0)["irradiance"], one, rtol=1e-5)
    # All are alike: whichever are drawn, the estimate is the sum.
    drawn = summed(many, 8)
    np.testing.assert_allclose(drawn["irradiance"], one, rtol=1e-5)
    assert drawn["variance"].max() <= 1e-9 * one.max() ** 2


def test_lights_at_the_very_points_of_pixels() -> None:
    at = gbuffer().position.reshape(-1, 3)
    lights = Lights(at, np.ones_like(at), np.zeros_like(at))
    for draws in (0, 4):
        found = summed(lights, draws, clamp_distance=0)
        assert all(np.isfinite(found[name]).all() for name in ("irradiance", "variance", "unshadowed"))


def test_black_lights_send_nothing_and_are_never_drawn() -> None:
    black = dataclasses.replace(LIGHTS, flux=0 * LIGHTS.flux)
    found = summed(black, 8)
    assert not found["irradiance"].any() and not found["variance"].any()
    half = LIGHTS.flux * (np.arange(len(LIGHTS)) % 2)[:, None]
    some = [summed(dataclasses.replace(LIGHTS, flux=half), n)["unshadowed"] for n in (0, 8)]
    np.testing.assert_allclose(*some, rtol=1e-12)


def test_more_draws_than_lights_are_exact() -> None:
    few = Lights(LIGHTS.position[:40], LIGHTS.flux[:40], LIGHTS.normal[:40])
    exact, drawn = summed(few, 0), summed(few, 40)
    assert np.array_equal(exact["irradiance"], drawn["irradiance"]) and drawn["exact_pixels"] == gbuffer().depth.size
    # Pixels that fewer lights reach than are drawn are exact on their own.
    lit = (oracle_weights(few) > 0).sum(axis=-1)
    middle = int(np.median(lit))
    some = summed(few, middle)
    is_exact = lit <= middle
    assert some["exact_pixels"] == is_exact.sum() and 0 < is_exact.mean() < 1
    assert np.array_equal(some["irradiance"][is_exact], exact["irradiance"][is_exact])
    assert not some["variance"][is_exact].any() and some["variance"][~is_exact].any()


def oracle_weights(lights: Lights) -> Array:
    """(H, W, n): what each light sends to each pixel unshadowed."""
    each = [
        oracle(ROOM, gbuffer(), Lights(*(rows[i : i + 1] for rows in (lights.position, lights.flux, lights.normal))),
               Params(), shadows=False) @ LUMINANCE
        for i in range(len(lights))
    ]  # fmt: skip
    return np.stack(each, axis=-1)


@cache
def passes(draws: int, count: int = 400) -> tuple[Array, Array]:
    """(count, H, W) luminance of independent estimates, and (count, H, W, 3) their reported variances."""
    found = [summed(in_morton_order(LIGHTS), draws, i) for i in range(count)]
    return np.stack([f["irradiance"] for f in found]), np.stack([f["variance"] for f in found])


@pytest.mark.parametrize("draws", [2, 16, 64])
def test_drawn_lights_have_no_bias(draws: int) -> None:
    exact = summed(LIGHTS, 0)["irradiance"]
    estimates, _ = passes(draws)
    for c in range(3):
        assert accept(welch_test(estimates[..., c], exact[None, ..., c], rounding=1e-5 * exact.max()))
    whole = estimates.sum(axis=(1, 2, 3))
    assert accept(welch_test(whole, [exact.sum()]))
    assert not accept(welch_test(whole, [1.01 * exact.sum()])), "the test would not see an error of 1 %"


@pytest.mark.parametrize("draws", [16, 64])
def test_the_variance_is_honest(draws: int) -> None:
    """Chi-square: the sum over passes of (estimate - exact)^2 over the variance that they report, on average."""
    exact = summed(LIGHTS, 0)["irradiance"][..., 1]
    estimates, variances = passes(draws)
    variance = variances[..., 1].mean(axis=0)
    noisy = variance > 1e-8 * exact.max() ** 2
    assert noisy.mean() > 0.9
    count = len(estimates)
    square = ((estimates[..., 1] - exact) ** 2).sum(axis=0)[noisy] / variance[noisy]

    def p_values(statistic: Array) -> Array:
        # Estimates are nearly normal, and the mean variance has noise of its own: about that of another chi-square.
        ratio = np.log(statistic / count) / np.sqrt(2 * 2 / count)
        return np.asarray(2 * stats.norm.sf(np.abs(ratio)))

    assert accept(p_values(square))
    whole = square.sum() / (count * len(square))
    assert whole == pytest.approx(1, abs=5 * np.sqrt(4 / (count * len(square))))
    assert not accept(p_values(2.0 * square)) and SIGNIFICANCE < 0.01


def test_strata_of_neighbours_pay() -> None:
    """In Morton order, lights of one stratum are neighbours, and mostly seen or hidden together: less noise."""
    rng = np.random.default_rng(1)
    centres = np.array([(1.5, 1.5, 1.5), (-1.6, 0.3, -0.9), (-1.5, 1.6, 1.0), (0.8, 0.4, -1.6)])  # seen, hidden
    position = (centres[rng.integers(0, 4, 300)] + rng.normal(0, 0.02, (300, 3))).astype(np.float32)
    lights = Lights(position, np.ones_like(position), np.zeros_like(position))
    noise = [
        np.mean([summed(given, 64, i)["variance"] for i in range(20)]) for given in (in_morton_order(lights), lights)
    ]
    assert 0 < noise[0] < 0.5 * noise[1]


def test_morton_order_keeps_lights_together() -> None:
    ordered = in_morton_order(LIGHTS)
    rows = [np.concatenate([x.position, x.flux, x.normal], axis=1) for x in (LIGHTS, ordered)]
    assert np.array_equal(*(np.array(sorted(map(tuple, r))) for r in rows))
    steps = [np.linalg.norm(np.diff(x.position, axis=0), axis=1).mean() for x in (LIGHTS, ordered)]
    assert steps[1] < 0.5 * steps[0]


@pytest.mark.parametrize("draws", [0, 16])
def test_any_number_of_threads(draws: int) -> None:
    before = _core.info()["threads"]
    try:
        found = []
        for threads in (1, 2, 3):
            _core.set_threads(threads)
            found.append(summed(LIGHTS, draws, 3))
    finally:
        _core.set_threads(before)
    for name in ("irradiance", "variance", "unshadowed"):
        assert np.array_equal(found[0][name], found[1][name]) and np.array_equal(found[0][name], found[2][name])


# --- the reference made of it ----------------------------------------------------------------------------------------


def test_the_reference_is_the_sum_times_the_albedo() -> None:
    g = ROOM.render_gbuffer(CAMERA, SIZE)
    params = Params(clamp_distance=0.1)
    found = brute_force(ROOM, CAMERA, SIZE, params, budget=Budget(spp=len(LIGHTS)))
    wanted = oracle(ROOM, g, LIGHTS, params) * g.albedo / np.pi
    np.testing.assert_allclose(found.indirect, wanted, rtol=3e-5, atol=1e-7)
    unshadowed = oracle(ROOM, g, LIGHTS, params, shadows=False)
    assert found.unshadowed is not None
    np.testing.assert_allclose(found.unshadowed, unshadowed, rtol=3e-5, atol=1e-7)
    assert found.exact and not found.indirect_variance.any() and found.relative_error == 0
    assert np.array_equal(found.colour, found.direct + found.indirect)


def test_lights_given_take_the_place_of_the_scenes() -> None:
    other = wall_lights(9, 30)
    found = brute_force(ROOM, CAMERA, SIZE, lights=other)
    assert not np.allclose(found.indirect, brute_force(ROOM, CAMERA, SIZE).indirect, rtol=0.1)
    wanted = oracle(ROOM, ROOM.render_gbuffer(CAMERA, SIZE), other, Params())
    albedo = ROOM.render_gbuffer(CAMERA, SIZE).albedo
    np.testing.assert_allclose(found.indirect, wanted * albedo / np.pi, rtol=3e-5, atol=1e-7)


def test_passes_are_weighted_by_their_draws() -> None:
    """Two runs that add up have the mean of both, weighted, and the variance of that mean."""
    estimator = BruteForce(ROOM, CAMERA, SIZE, Params())
    parts = []
    for draws in (32, 96):
        target = estimator.samples + draws
        while estimator.samples < target:
            estimator.step(target - estimator.samples, None)
    found = estimator.reference()
    lights, g = in_morton_order(LIGHTS), ROOM.render_gbuffer(CAMERA, SIZE)
    parts = [
        ROOM.brute_force(lights, g, (0, SIZE[1]), Params(), draws=draws, pass_number=i)
        for i, draws in enumerate((32, 96))
    ]
    mean = (32 * parts[0]["irradiance"] + 96 * parts[1]["irradiance"]) / 128
    variance = (32**2 * parts[0]["variance"] + 96**2 * parts[1]["variance"]) / 128**2
    np.testing.assert_allclose(found.indirect, mean * g.albedo / np.pi, rtol=1e-6)
    np.testing.assert_allclose(found.indirect_variance, variance * (g.albedo / np.pi) ** 2, rtol=1e-6)
    assert found.samples == 128 and not found.exact


@pytest.mark.parametrize("rays", [1e9, 50.0])
def test_bands_of_rows_make_no_difference(rays: float, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = brute_force(ROOM, CAMERA, SIZE, budget=Budget(spp=32))
    monkeypatch.setattr(sys.modules["lab.reference.brute_force"], "_RAYS_A_BAND", rays)
    assert np.array_equal(brute_force(ROOM, CAMERA, SIZE, budget=Budget(spp=32)).indirect, whole.indirect)
