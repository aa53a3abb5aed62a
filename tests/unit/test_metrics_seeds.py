"""Noise and bias told apart over seeds."""

from __future__ import annotations

import numpy as np
import pytest

from lab.errors import LabError
from lab.metrics import bias_variance, moments, rel_mse, temporal


def test_moments_are_those_of_numpy_and_keep_their_digits() -> None:
    images = np.random.default_rng(1).normal(size=(7, 4, 5, 3)) + 1e8
    found = moments(image for image in images)
    assert found.count == 7
    np.testing.assert_allclose(found.mean, images.mean(axis=0), rtol=1e-15)
    np.testing.assert_allclose(found.variance, images.var(axis=0, ddof=1), rtol=1e-6)


def test_bias_and_variance_are_told_apart_without_bias() -> None:
    rng = np.random.default_rng(2)
    shape, seeds, bias, deviation = (300, 300), 4, 0.3, 0.5
    reference = rng.uniform(1, 3, shape)
    images = reference + bias + deviation * rng.normal(size=(seeds, *shape))
    found = bias_variance(images, reference)
    # Standard errors of these means over 90,000 pixels: 6e-4 and 9e-4.
    assert found.bias2.mean() == pytest.approx(bias**2, abs=3e-3)
    assert found.variance.mean() == pytest.approx(deviation**2, abs=4e-3)
    naive = ((images.mean(axis=0) - reference) ** 2).mean()
    assert naive == pytest.approx(bias**2 + deviation**2 / seeds, abs=3e-3)
    assert abs(naive - bias**2) > 0.05, "what is subtracted matters in this test"
    assert found.bias2.shape == found.variance.shape == shape


def test_both_parts_add_up_to_the_mean_rel_mse() -> None:
    rng = np.random.default_rng(3)
    reference = rng.uniform(0, 2, (5, 6, 3))
    images = reference * rng.uniform(0.5, 1.8, (6, 5, 6, 3))
    found = bias_variance(list(images), reference)
    assert found.rel_bias2 + found.rel_variance == pytest.approx(
        np.mean([rel_mse(image, reference) for image in images]), rel=1e-12
    )


def test_the_noise_of_the_reference_is_no_bias() -> None:
    rng = np.random.default_rng(4)
    truth = np.full((200, 200), 2.0)
    reference = truth + 0.4 * rng.normal(size=truth.shape)
    images = truth + 0.1 * rng.normal(size=(8, *truth.shape))
    assert bias_variance(images, reference).bias2.mean() == pytest.approx(0.16, abs=0.01)
    assert bias_variance(images, reference, reference_variance=0.16).bias2.mean() == pytest.approx(0, abs=0.01)


def test_flicker_is_relative_to_each_pixels_mean() -> None:
    mean = np.array([[1.0, 10.0], [100.0, 0.0]])
    frames = [mean * factor for factor in (0.9, 1.0, 1.1)]
    average, flicker = temporal(frames)
    floor2 = (0.01 * mean.mean()) ** 2
    expected = np.array([[0.1 * m / np.sqrt(m**2 + floor2) if m else 0 for m in row] for row in mean])
    np.testing.assert_allclose(flicker, expected, rtol=1e-9)
    assert average == pytest.approx(expected.mean(), rel=1e-9)
    assert temporal([mean, mean])[0] == 0
    assert temporal(np.zeros((3, 2, 2)))[0] == 0


def test_one_rendering_says_nothing_of_noise() -> None:
    with pytest.raises(LabError, match="got 1"):
        moments([np.ones((2, 2))])
    with pytest.raises(LabError, match="got 0"):
        bias_variance([], np.ones(3))
    with pytest.raises(LabError, match=r"\(2,\).*\(3,\)"):
        moments([np.ones(3), np.ones(2)])
    with pytest.raises(LabError, match="same shape"):
        bias_variance(np.ones((2, 4)), np.ones(3))
