"""The judge's own arithmetic, on pictures made of numbers; with Mitsuba it works in tests/external."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.experiments import mitsuba_runner
from lab.experiments.equal_flip import Point, solid, time_to
from lab.experiments.mitsuba_judge import in_blocks, judge
from lab.experiments.mitsuba_runner import Layer, Mitsuba
from lab.scene.scene import Material, Scene


def noisy(truth: np.ndarray, seed: int, scale: float = 1.0) -> Layer:
    """`truth` with Gaussian noise of a tenth of each value."""
    noise = 0.1 * truth
    return Layer(scale * (truth + noise * np.random.default_rng(seed).standard_normal(truth.shape)), noise**2)


@pytest.fixture
def truth() -> np.ndarray:
    return np.random.default_rng(1).uniform(0.2, 3.0, (40, 61, 3))


def test_blocks_are_means_with_their_own_variance(truth: np.ndarray) -> None:
    found = in_blocks(noisy(truth, 2), 8)
    layer = noisy(truth, 2)
    assert found.mean.shape == found.variance.shape == (5, 7, 3)
    for y, x in ((0, 0), (4, 6), (2, 3)):
        part = np.s_[8 * y : 8 * y + 8, 8 * x : 8 * x + 8]
        np.testing.assert_allclose(found.mean[y, x], layer.mean[part].reshape(-1, 3).mean(axis=0))
        np.testing.assert_allclose(found.variance[y, x], layer.variance[part].reshape(-1, 3).sum(axis=0) / 64**2)
    assert in_blocks(Layer(truth[:3, :5], truth[:3, :5]), 8).mean.shape == (1, 1, 3)


def test_noise_alone_agrees(truth: np.ndarray) -> None:
    verdicts = [judge("any", noisy(truth, 2 * i), noisy(truth, 2 * i + 1)) for i in range(40)]
    assert sum(not v.blocks.accepted for v in verdicts) <= 2  # 1 % of them, by chance
    assert np.mean([v.spread for v in verdicts]) == pytest.approx(1, abs=0.03)
    errors = np.array([(v.energy - 1) / v.energy_error for v in verdicts])
    assert np.abs(errors).max() < 3.5  # the standard error is an upper bound
    assert 0.3 < errors.std() < 1.2
    assert all(v.agrees() for v in verdicts if v.blocks.accepted)


def test_what_noise_does_not_explain_is_refused(truth: np.ndarray) -> None:
    brighter = judge("any", noisy(truth, 1, 1.03), noisy(truth, 2))
    assert brighter.energy == pytest.approx(1.03, abs=3 * brighter.energy_error) and not brighter.agrees()
    moved = truth.copy()
    moved[8:16, 16:24] *= 1.3
    dented = judge("any", noisy(moved, 1), noisy(truth, 2))
    assert abs(dented.energy - 1) < 0.01 and not dented.agrees()
    assert 1 <= dented.blocks.failing <= 3  # one block, its three channels


def test_exact_pictures_may_differ_by_rounding(truth: np.ndarray) -> None:
    exact = Layer(truth, np.zeros_like(truth))
    assert judge("any", Layer(truth * (1 + 5e-5), exact.variance), exact).blocks.accepted
    assert not judge("any", Layer(truth * (1 + 5e-4), exact.variance), exact).blocks.accepted


def test_black_pictures(truth: np.ndarray) -> None:
    lit, black = (Layer(mean, np.zeros_like(truth)) for mean in (truth, np.zeros_like(truth)))
    assert judge("any", black, lit).energy == 0 and not judge("any", black, lit).agrees()
    assert judge("any", lit, black).energy == math.inf and not judge("any", lit, black).agrees()
    assert judge("any", black, black).agrees()


def test_time_to_equal_error() -> None:
    points = [Point(n, 0.1 * n, n**-0.5, 0.0) for n in (1, 2, 4, 8)]
    assert time_to(0.5, points) == pytest.approx(0.4)
    assert time_to(6**-0.5, points) == pytest.approx(0.6)  # a power law is met exactly between its points
    assert time_to(2.0, points) == 0.1
    assert time_to(0.1, points) == math.inf


def test_solid_scenes_have_no_holes() -> None:
    scene = Scene("s", [], [Material(alpha_cutoff=0.5, texture=0), Material(alpha_cutoff=0.0)])
    assert [material.alpha_cutoff for material in solid(scene).materials] == [0, 0]


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(mitsuba_runner, "installed", lambda: True)
    monkeypatch.setattr(mitsuba_runner, "llvm_library", lambda: None)
    with pytest.raises(LabError, match="needs LLVM 17 or newer"):
        Mitsuba(tmp_path / "scene.xml", mitsuba_runner.LLVM)
    monkeypatch.setattr(mitsuba_runner, "installed", lambda: False)
    with pytest.raises(LabError, match="make setup EXTRA=test"):
        Mitsuba(tmp_path / "scene.xml")
