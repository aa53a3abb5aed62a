"""When a refinement ends, what it tells on the way, and what budgets are refused."""

from __future__ import annotations

import math
import time
from functools import cache
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.reference import Budget, Reference, brute_force, path_traced
from lab.reference.estimate import refine
from lab.reference.path_tracer import mean_variance
from lab.scene.scene import Camera, PointLight

from ..oracle_geometry.scenes import occluded_room, wall_lights

CAMERA = Camera("inside", (1.6, 1.2, 1.8), (-0.3, 0.6, -0.4), fov_y_deg=80.0)
SIZE = (16, 9)


@cache
def room() -> CpuEngine:
    return CpuEngine(occluded_room(points=[PointLight((0.9, 1.5, 0.9), (1.0, 2.0, 4.0))]))


def traced(**budget: Any) -> Reference:
    return path_traced(room(), CAMERA, SIZE, budget=Budget(**budget))


def summed(**budget: Any) -> Reference:
    return brute_force(room(), CAMERA, SIZE, Params(vpls=20_000), budget=Budget(**budget))


WAYS = {"path_tracer": traced, "brute_force": summed}


@pytest.mark.parametrize("spp", [2, 10, 100])
@pytest.mark.parametrize("way", WAYS)
def test_as_many_samples_as_asked_for(way: str, spp: int) -> None:
    assert WAYS[way](spp=spp).samples == spp


@pytest.mark.parametrize(("way", "usual"), [("path_tracer", 256), ("brute_force", 1024)])
def test_without_a_budget(way: str, usual: int) -> None:
    assert WAYS[way]().samples == usual


@pytest.mark.parametrize("way", WAYS)
def test_by_error(way: str) -> None:
    start = WAYS[way](spp=16).relative_error
    wanted = start / 5
    found = WAYS[way](error=wanted)
    assert found.relative_error <= wanted
    assert 16 * 25 / 3 < found.samples < 16 * 25 * 3, "no more than it takes"
    assert WAYS[way](error=10.0).samples < 100


def test_the_relative_error_is_that_of_the_indirect_light() -> None:
    found = traced(spp=64)
    weights = np.array([0.2126, 0.7152, 0.0722])
    wanted = (np.sqrt(found.indirect_variance) @ weights).mean() / (found.indirect @ weights).mean()
    assert found.relative_error == pytest.approx(wanted, rel=1e-12)
    runs = np.stack(
        [path_traced(room(), CAMERA, SIZE, Params(seed=s), budget=Budget(spp=64)).indirect for s in range(40)]
    )
    # Its channels share their paths, nearly: the error of their luminance is nearly that of each.
    measured = (runs @ weights).std(axis=0, ddof=1).mean() / (runs @ weights).mean()
    assert 0.8 * measured < found.relative_error < 1.3 * measured


@pytest.mark.parametrize("way", WAYS)
def test_by_time(way: str) -> None:
    start = time.monotonic()
    found = WAYS[way](seconds=0.5)
    elapsed = time.monotonic() - start
    assert (elapsed > 0.4 or found.exact) and elapsed < 5, "a busy machine included"
    assert found.samples > 0 and 0 < found.seconds <= elapsed


@pytest.mark.parametrize("way", WAYS)
def test_there_is_something_to_show_whatever_the_clock_says(way: str) -> None:
    assert WAYS[way](seconds=1e-9).samples > 0


def test_whichever_comes_first() -> None:
    assert traced(spp=8, seconds=100.0, error=1e-9).samples == 8
    assert traced(spp=10**6, error=10.0).samples < 1000
    assert traced(spp=10**8, seconds=0.2).samples < 10**8


def test_an_exact_sum_ends_whatever_is_asked_for() -> None:
    engine = CpuEngine(occluded_room(wall_lights(2, 50)))
    for budget in (Budget(error=1e-9), Budget(spp=10**6), Budget(seconds=60.0)):
        found = brute_force(engine, CAMERA, SIZE, budget=budget)
        assert found.exact and found.relative_error == 0 and found.seconds < 10


def test_progress_goes_from_0_to_1() -> None:
    for function, params in ((path_traced, Params()), (brute_force, Params(vpls=20_000, compensation="path"))):
        seen: list[tuple[float, str]] = []
        function(
            room(), CAMERA, (48, 27), params, budget=Budget(spp=64),
            progress=lambda share, line, seen=seen: seen.append((share, line)),
        )  # fmt: skip
        shares = [share for share, _ in seen]
        assert shares == sorted(shares) and shares[0] == 0 and shares[-1] == 1 and len(shares) > 3
        assert "64 samples a pixel, relative error" in seen[-1][1] and "%" in seen[-1][1]


# --- a scripted estimator --------------------------------------------------------------------------------------------


class Scripted:
    """Half a second of pretended work a step; its error falls as it should."""

    default_spp = 8
    exact = False
    pending = 0.0

    def __init__(self) -> None:
        self.samples, self.seconds, self.asked = 0, 0.0, []  # type: ignore[var-annotated]

    def step(self, most: int | None, guess: int | None) -> None:
        self.asked.append((most, guess))
        self.samples += 4 if most is None else min(4, most)

    def reference(self) -> Reference:
        ones = np.ones((1, 1, 3))
        variance = ones / self.samples
        return Reference("scripted", 0 * ones, ones, 0 * ones, variance, variance, self.samples, False, 0.0)

    def state(self) -> dict[str, Any]:
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        raise NotImplementedError


def test_what_an_estimator_is_asked_for() -> None:
    estimator = Scripted()
    refine(estimator, Budget(spp=10))
    assert estimator.asked == [(10, None), (6, None), (2, None)]
    estimator = Scripted()
    refine(estimator, Budget(error=0.25))
    # 1 / sqrt(16) is reached; before, 3 times as many samples as there are is the most that is guessed.
    assert estimator.samples == 16
    assert all(most is None for most, _ in estimator.asked) and estimator.asked[0][1] is None
    assert [guess for _, guess in estimator.asked[1:]] == pytest.approx([12, 8, 4], abs=1)


def test_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    saved: list[int] = []
    estimator = Scripted()
    refine(estimator, Budget(), checkpoint=lambda: saved.append(estimator.samples))
    assert saved == [8], "at the end"
    refine(estimator, Budget(), checkpoint=lambda: saved.append(estimator.samples))
    assert saved == [8], "and not where nothing was done"
    monkeypatch.setattr("lab.reference.estimate._SAVE_EVERY", -1.0)
    saved.clear()
    estimator = Scripted()
    refine(estimator, Budget(spp=12), checkpoint=lambda: saved.append(estimator.samples))
    assert saved == [4, 8, 12], "and now and then"


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "budget",
    [{"spp": 0}, {"spp": -1}, {"spp": 1.5}, {"spp": 2**31}, {"error": 0.0}, {"error": -1.0}, {"error": math.nan},
     {"error": math.inf}, {"seconds": 0.0}, {"seconds": math.nan}],
)  # fmt: skip
def test_budgets_are_checked(budget: dict[str, Any]) -> None:
    with pytest.raises(LabError, match=next(iter(budget))):
        Budget(**budget)


def test_the_variance_of_a_mean() -> None:
    samples = np.random.default_rng(1).gamma(0.3, 1, (50, 4, 3, 3))
    found = mean_variance(samples.sum(axis=0), (samples**2).sum(axis=0), 50)
    np.testing.assert_allclose(found, samples.var(axis=0, ddof=1) / 50, rtol=1e-10)
    equal = np.full((50, 2), 0.1)
    assert not mean_variance(equal.sum(axis=0), (equal**2).sum(axis=0), 50).any()
    assert np.isinf(mean_variance(np.ones(1), np.ones(1), 1)).all()
    assert not mean_variance(np.zeros(1), np.zeros(1), 1).any()
