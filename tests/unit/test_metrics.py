"""Errors against a reference: the documented formulas, value by value."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lab import metrics
from lab.errors import LabError


@pytest.fixture
def pair() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    reference = np.exp(rng.normal(size=(6, 8, 3)))
    return reference * rng.uniform(0.5, 1.6, reference.shape), reference


def loop_rel_mse(a: np.ndarray, b: np.ndarray, floor: float) -> float:
    """The definition, one value after the other."""
    terms = [(x - y) ** 2 / (y**2 + floor**2) for x, y in zip(a.ravel().tolist(), b.ravel().tolist(), strict=True)]
    return math.fsum(terms) / len(terms)


def test_rel_mse_is_floored_at_a_hundredth_of_the_mean(pair: tuple[np.ndarray, np.ndarray]) -> None:
    a, b = pair
    b[0, :4] = 0  # The floor is all that counts here.
    floor = 0.01 * math.fsum(b.ravel().tolist()) / b.size
    assert metrics.floor_of(b) == pytest.approx(floor, rel=1e-12)
    assert metrics.rel_mse(a, b) == pytest.approx(loop_rel_mse(a, b, floor), rel=1e-12)
    assert metrics.rel_mse(a, b) != pytest.approx(loop_rel_mse(a, b, 1.1 * floor), rel=1e-2)
    assert metrics.rel_mse(a, b, epsilon=0.3) == pytest.approx(loop_rel_mse(a, b, 0.3), rel=1e-12)


def test_rel_mse_of_parts_averages_to_the_whole(pair: tuple[np.ndarray, np.ndarray]) -> None:
    a, b = pair
    floor = metrics.floor_of(b)
    parts = [metrics.rel_mse(a[..., c], b[..., c], epsilon=floor) for c in range(3)]
    assert np.mean(parts) == pytest.approx(metrics.rel_mse(a, b), rel=1e-12)


def test_absolute_errors(pair: tuple[np.ndarray, np.ndarray]) -> None:
    a, b = pair
    squares = [(x - y) ** 2 for x, y in zip(a.ravel().tolist(), b.ravel().tolist(), strict=True)]
    assert metrics.mse(a, b) == pytest.approx(math.fsum(squares) / len(squares), rel=1e-12)
    assert metrics.rmse(a, b) == pytest.approx(math.sqrt(math.fsum(squares) / len(squares)), rel=1e-12)


def test_energy_ratio_is_of_the_image_over_the_reference(pair: tuple[np.ndarray, np.ndarray]) -> None:
    _, b = pair
    assert metrics.energy_ratio(0.8 * b, b) == pytest.approx(0.8, rel=1e-12)
    assert metrics.energy_ratio(np.zeros_like(b), b) == 0


def test_relative_error_is_signed_and_squares_to_rel_mse(pair: tuple[np.ndarray, np.ndarray]) -> None:
    a, b = pair
    error = metrics.relative_error(a, b)
    assert ((error > 0) == (a > b)).all() and error.shape == a.shape
    assert np.mean(error**2) == pytest.approx(metrics.rel_mse(a, b), rel=1e-12)


def test_a_perfect_image_has_the_noise_of_its_reference_as_error() -> None:
    rng = np.random.default_rng(2)
    truth = rng.uniform(0.5, 2, (200, 200, 3))
    deviation = 0.02 * truth * rng.uniform(0.5, 1.5, truth.shape)
    reference = truth + deviation * rng.normal(size=truth.shape)
    noise = metrics.rel_mse_noise(reference, deviation**2)
    assert metrics.rel_mse(truth, reference) == pytest.approx(noise, rel=0.02)
    assert noise == pytest.approx(np.mean(0.02**2 * rng.uniform(0.5, 1.5, 400_000) ** 2), rel=0.02)


def test_float32_and_integers_are_computed_in_float64() -> None:
    a, b = np.float32([1e20, 1.0]), np.float32([1e20, 2.0])
    assert metrics.mse(a, b) == 0.5
    assert metrics.mse(np.float32([1e30]), np.float32([0])) == pytest.approx(1e60, rel=1e-6)
    counts = np.array([3, 1], dtype=np.uint32)
    assert metrics.mse(counts, counts[::-1]) == 4
    assert metrics.energy_ratio(np.float16([60000.0, 60000.0]), np.float16([60000.0, 0.0])) == 2


def test_against_black_nothing_but_black_is_near() -> None:
    black = np.zeros((2, 2, 3))
    assert metrics.rel_mse(black, black) == 0
    assert metrics.rel_mse(black + 5, black) > 1e300
    assert not np.isnan(metrics.relative_error(black + 5, black)).any()


@pytest.mark.parametrize("name", ["rel_mse", "mse", "rmse", "energy_ratio", "relative_error", "rel_mse_noise"])
def test_shapes_must_agree(name: str) -> None:
    metric = getattr(metrics, name)
    with pytest.raises(LabError, match=r"\(2, 3\).*\(3, 2\)"):
        metric(np.ones((2, 3)), np.ones((3, 2)))
    with pytest.raises(LabError, match="pixels in it"):
        metric(np.ones((0, 3)), np.ones((0, 3)))
