"""The error budget of small scenes: each number again by another way, and what must be zero."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from lab.attribute import Effort, ErrorBudget, attribute
from lab.attribute.bench import Bench, Picture
from lab.attribute.budget import Row
from lab.attribute.score import Judge
from lab.attribute.terms import TERMS, ideal
from lab.engine.cpu import CpuEngine
from lab.metrics import flip
from lab.params import PRESETS, Params, preset
from lab.reference import Budget, brute_force, path_traced
from lab.scene.scene import Camera, PointLight, Scene

from ..oracle.brute_force import brute_force as oracle
from ..oracle_geometry.scenes import Array, occluded_room, wall_lights

CAMERA = Camera("inside", (1.6, 1.2, 1.8), (-0.3, 0.6, -0.4), fov_y_deg=80.0)
SIZE = (20, 12)
PARAMS = Params(vpls=600, shadow_samples=2)
EFFORT = Effort(paths=32, draws=1000, short_paths=32, frames=2)


def room(**more: Any) -> Scene:
    return occluded_room(points=[PointLight((0.9, 1.5, 0.9), (1.0, 2.0, 4.0))], **more)


def measured(scene: Scene, params: Params, **more: Any) -> ErrorBudget:
    return attribute(scene, params, camera=CAMERA, size=SIZE, effort=EFFORT, cache=False, **more)


@cache
def budget() -> ErrorBudget:
    return measured(room(), PARAMS, changes={"vpls": 600})


def row(name: str, found: ErrorBudget | None = None) -> Row:
    return next(r for r in (found or budget()).rows if r.term.name == name)


# --- the score -------------------------------------------------------------------------------------------------------


def rel_mse(a: Array, b: Array, c: Array, variance: Array | float, epsilon: float) -> float:
    return float((((a - b) ** 2 - variance) / (c**2 + epsilon**2)).mean())


def test_the_frame_is_scored_against_the_truth() -> None:
    found = budget()
    engine = CpuEngine(room())
    truth = path_traced(engine, CAMERA, SIZE, PARAMS, budget=Budget(spp=32))
    summed = brute_force(engine, CAMERA, SIZE, PARAMS, budget=Budget(spp=1000))
    g = engine.render_gbuffer(CAMERA, SIZE)
    left = engine.trace_compensation(g, 0, 32, PARAMS)["irradiance"] / 32 * g.albedo / np.pi
    frame = lab.render(room(), PARAMS, camera=CAMERA, size=SIZE).image
    normal, epsilon = summed.indirect + left, 0.01 * truth.indirect.mean()
    score = found.frame.score
    wanted = rel_mse(frame.indirect, truth.indirect, normal, truth.indirect_variance, epsilon)
    assert score.rel_mse == pytest.approx(wanted, rel=1e-4)
    assert score.energy == pytest.approx(frame.indirect.sum() / truth.indirect.sum(), rel=1e-5)
    assert score.flip == pytest.approx(flip(frame.colour, truth.direct + normal)[0], rel=1e-3)
    assert found.judge.epsilon == pytest.approx(epsilon)
    pixels = ((frame.indirect - truth.indirect) ** 2 - truth.indirect_variance) / (normal**2 + epsilon**2)
    assert score.rel_mse_error == pytest.approx(pixels.mean(axis=-1).std() / np.sqrt(SIZE[0] * SIZE[1]), rel=1e-4)
    rest = np.sort(pixels.mean(axis=-1).ravel())[:-1]
    assert score.rel_mse_rest == pytest.approx(rest.mean(), rel=1e-4)
    assert found.seconds > 0 and found.frame.seconds > 0


def test_noise_is_taken_off() -> None:
    """Over many noisy truths and noisy pictures, the mean score is that without noise."""
    judge = Judge.__new__(Judge)
    rng = np.random.default_rng(1)
    exact = rng.gamma(2, 1, (30, 40, 3))
    picture = exact * 1.1
    judge.compensated = Picture(exact)
    judge.epsilon = 0.01 * exact.mean()
    judge._scale2 = exact**2 + judge.epsilon**2
    wanted = judge.score(Picture(picture), Picture(exact)).rel_mse
    assert wanted == pytest.approx(rel_mse(picture, exact, exact, 0, judge.epsilon), rel=1e-9)
    scores, spread = [], 0.5 * exact
    for _ in range(200):
        truth, image = (x + rng.normal(0, 1, exact.shape) * spread for x in (exact, picture))
        scores.append(judge.score(Picture(image, spread**2), Picture(truth, spread**2)).rel_mse)
    assert np.mean(scores) == pytest.approx(wanted, abs=4 * np.std(scores) / np.sqrt(200))
    noisy = judge.score(Picture(picture + rng.normal(0, 1, exact.shape) * spread), Picture(exact)).rel_mse
    assert noisy > 10 * wanted, "it would be seen"
    assert judge.noise(Picture(exact, spread**2)) == pytest.approx(0.25, rel=0.02)


# --- on alone --------------------------------------------------------------------------------------------------------


def test_every_term_is_measured_on_both_sides() -> None:
    found = budget()
    assert [r.term.name for r in found.rows if r.term in TERMS] == [term.name for term in TERMS]
    assert not found.notes
    for r in found.rows:
        assert r.on is not None and np.isfinite(r.on.effect) and r.on.difference.shape == SIZE[::-1]
        assert (r.off is None) == (r.term.name == "hierarchy_shadows")
        for side in (r.on, r.off):
            if side is not None:
                assert "against" in side.sentence and side.sentence.endswith(".")
                assert np.isfinite([side.score.rel_mse, side.score.energy, side.effect_rest]).all()
        assert r.active == (r.term.active(PARAMS) or r.off is None)


def test_finite_lights_on_alone() -> None:
    found = budget()
    judge, side = found.judge, row("vpls").on
    assert side is not None
    variance = found.bench.truth.indirect_variance + np.asarray(judge.compensated.variance)
    wanted = rel_mse(
        judge.compensated.radiance, found.bench.truth.indirect, judge.compensated.radiance, variance, judge.epsilon
    )
    assert side.effect == pytest.approx(wanted) == side.score.rel_mse and side.score.flip is None


def test_the_clamp_on_alone_is_what_short_paths_find() -> None:
    found = budget()
    judge, side = found.judge, row("clamp").on
    left = judge.left_out
    assert side is not None and left is not None and left.radiance.any()
    expected = ((left.radiance**2 - left.variance) / (judge.compensated.radiance**2 + judge.epsilon**2)).mean()
    assert side.effect == pytest.approx(expected)
    assert side.energy_effect == pytest.approx(-left.radiance.sum() / judge.truth.radiance.sum())
    assert (side.difference <= 0).all()


def test_the_hierarchy_on_alone_is_its_light_with_exact_shadows() -> None:
    found = budget()
    engine, params = CpuEngine(room()), found.bench.ideal
    g = engine.render_gbuffer(CAMERA, SIZE)
    lights = engine.trace_vpls(params)
    exact = oracle(engine, g, lights, params, shadows=False)
    shadowed = oracle(engine, g, lights, params)
    lit = engine.light(engine.build_hierarchy(lights, params), g, params).irradiance
    reflectance = g.albedo / np.pi
    wanted = lit * np.divide(shadowed, exact, out=np.zeros_like(exact), where=exact > 0) * reflectance
    side = row("hierarchy").on
    assert side is not None
    scale = found.judge.compensated.radiance
    effect = rel_mse(wanted, shadowed * reflectance, scale, 0.0, found.judge.epsilon)
    assert side.effect == pytest.approx(effect, rel=1e-3) and effect > 1e-3
    assert side.score.energy == pytest.approx(wanted.sum() / (shadowed * reflectance).sum(), rel=1e-4)


def test_a_hierarchy_of_the_lights_alone_has_no_error() -> None:
    """At a huge alpha only the lights themselves are drawn: terms of the hierarchy have nothing to act on."""
    found = measured(room(), PARAMS.replace(alpha=1e5))
    for name in ("hierarchy", "construction", "gathering", "centre", "lobe", "lobe_energy"):
        side = row(name, found).on
        assert side is not None and abs(side.effect) < 1e-6 and abs(side.energy_effect) < 1e-4, name
    for name in ("shadow_points", "omega"):
        side = row(name, found).on
        assert side is not None and abs(side.effect) < 2e-3, name
    whole = row("hierarchy_shadows", found).on
    assert whole is not None and abs(whole.effect) < 5e-3 and whole.score.energy == pytest.approx(1, abs=0.01)
    few = row("samples", found).on
    assert few is not None and few.effect > 0.01, "but few samples are noisy"


def test_converged_shadows_are_told_from_their_noise() -> None:
    """Twice as many frames: the same effects, but for what noise is left."""
    more = attribute(
        room(), PARAMS, camera=CAMERA, size=SIZE, cache=False, effort=dataclasses.replace(EFFORT, frames=6)
    )
    for name in ("hierarchy_shadows", "shadow_points", "average"):
        few, many = row(name).on, row(name, more).on
        assert few is not None and many is not None
        assert few.effect == pytest.approx(many.effect, rel=0.15, abs=2e-3), name


# --- off alone -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["hierarchy", "lobe", "samples", "interleave", "filter"])
def test_off_alone_is_the_difference_of_two_frames(name: str) -> None:
    found, r = budget(), row(name)
    changed = r.term.without(PARAMS) if r.active else PARAMS.replace(**r.term.approximate)
    frames = [
        lab.render(room(), p, camera=CAMERA, size=SIZE).image.indirect.astype(np.float64) for p in (PARAMS, changed)
    ]
    truth, scale = found.bench.truth, found.judge.compensated.radiance
    before, after = (rel_mse(f, truth.indirect, scale, truth.indirect_variance, found.judge.epsilon) for f in frames)
    side = r.off
    assert side is not None
    assert side.score.rel_mse == pytest.approx(after, rel=1e-4)
    assert side.effect == pytest.approx(before - after if r.active else after - before, rel=1e-3)
    sign = 1 if r.active else -1
    assert side.energy_effect == pytest.approx(
        sign * (frames[0].sum() - frames[1].sum()) / truth.indirect.sum(), rel=1e-3
    )


def test_terms_that_a_frame_does_without_are_added() -> None:
    assert [r.term.name for r in budget().rows if not r.active and r.term.name in ("interleave", "lobe", "vpls")] == [
        "lobe", "interleave"
    ]  # fmt: skip
    paper = measured(room(), preset("paper", vpls=600))
    assert row("lobe", paper).active and row("shadow_points", paper).active and not row("ratio_rgb", paper).active
    for r in paper.rows:
        assert r.chosen == {name: paper.bench.params.to_dict()[name] for name in r.term.settings}


# --- presets and the way from the truth to the frame -----------------------------------------------------------------


def test_presets_are_ranked() -> None:
    found = budget().presets
    assert {f.name for f in found} == set(PRESETS)
    assert [f.score.rel_mse for f in found] == sorted(f.score.rel_mse for f in found)
    for f in found:
        assert f.params == preset(f.name, vpls=600) and f.seconds > 0
        image = lab.render(room(), f.params, camera=CAMERA, size=SIZE).image
        np.testing.assert_array_equal(f.indirect.radiance, image.indirect)
    # The converged, sharper sum comes first, the frame last.
    assert [rung.name for rung in budget().ladder] == ["summed", "clamped", "hierarchy", "converged", "frame"]
    assert budget().ladder[-1].score == budget().frame.score
    assert budget().ladder[0].score.rel_mse < budget().ladder[-1].score.rel_mse


def test_a_scene_lit_by_a_list() -> None:
    """Its truth is the sum over the list with no clamp."""
    scene = occluded_room(wall_lights(3, 80))
    found = measured(scene, Params(clamp_distance=0.2))
    assert found.bench.truth.method == "brute_force" and found.bench.truth.exact
    engine = CpuEngine(scene)
    g = engine.render_gbuffer(CAMERA, SIZE)
    assert scene.light_list is not None
    sums = [oracle(engine, g, scene.light_list, Params(clamp_distance=c)) * g.albedo / np.pi for c in (0.0, 0.2)]
    np.testing.assert_allclose(found.bench.truth.indirect, sums[0], rtol=1e-4, atol=1e-7)
    names = [r.term.name for r in found.rows]
    assert "vpls" not in names and "clamp" in names
    clamp = row("clamp", found).on
    assert clamp is not None
    assert clamp.effect == pytest.approx(rel_mse(sums[1], sums[0], sums[0], 0.0, found.judge.epsilon), rel=1e-3)
    assert [rung.name for rung in found.ladder] == ["summed", "hierarchy", "converged", "frame"]
    np.testing.assert_allclose(found.judge.direct, found.bench.summed.direct)


def test_a_frame_without_shadows() -> None:
    found = measured(room(), PARAMS.replace(shadow_samples=0))
    samples = row("samples", found)
    assert samples.active and samples.on is not None and samples.on.score.energy > 1.05, "unshadowed light is brighter"


def test_progress_and_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[float, str]] = []

    def too_much(lights: int, size: tuple[int, int], params: Params) -> None:
        if lights > PARAMS.vpls:
            raise lab.LabError("needs more memory than there is")

    monkeypatch.setattr("lab.attribute.bench.check_memory", too_much)
    found = measured(room(), PARAMS, changes={"vpls": 600}, progress=lambda share, line: seen.append((share, line)))
    shares = [share for share, _ in seen]
    assert shares == sorted(shares) and shares[0] >= 0 and 0.9 < shares[-1] <= 1
    assert {"tracing paths for the truth", "lobe off alone", "rendering preset demo"} <= {line for _, line in seen}
    assert row("vpls", found).off is None and found.notes and "more memory" in found.notes[0]


def test_references_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_CACHE", str(tmp_path))
    bench = Bench(room(), CAMERA, SIZE, PARAMS)
    bench.trace_truth(4, 16, lambda _: None)
    assert bench.truth.reused == 0 and len(list((tmp_path / "references").iterdir())) == 1
    again = Bench(room(), CAMERA, SIZE, PARAMS.replace(alpha=3))
    again.trace_truth(4, 16, lambda _: None)
    assert again.truth.reused == 4
    assert ideal(PARAMS) == bench.ideal
