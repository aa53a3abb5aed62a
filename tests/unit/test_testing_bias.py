"""The assertion over many seeds finds a bias, and only a bias."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from lab.errors import LabError
from lab.image_io import read_exr
from lab.testing import assert_unbiased
from lab.testing.blocks import Blocks

SHAPE = (20, 28, 3)
REFERENCE = np.random.default_rng([9, 9]).uniform(0.2, 1.0, SHAPE)


def noisy(seed: int, scale: float = 0.2) -> np.ndarray:
    return REFERENCE * np.random.default_rng(seed).uniform(1 - scale, 1 + scale, SHAPE)


def test_blocks_are_means_of_their_pixels() -> None:
    blocks = Blocks(SHAPE, 8)
    vector = blocks.means(REFERENCE)
    assert len(vector) == (3 * 4 + 1) * 3
    i = (1 * 4 + 3) * 3 + 2  # row 1, the last column of 4 pixels, blue
    assert vector[i] == pytest.approx(REFERENCE[8:16, 24:28, 2].mean()) and blocks.pixels[i] == 32
    assert blocks.name(i, (0, 0)) == "x=24..27 y=8..15 B" and blocks.name(i, (100, 10)) == "x=124..127 y=18..25 B"
    np.testing.assert_allclose(vector[-3:], REFERENCE.mean(axis=(0, 1)))
    assert blocks.name(len(vector) - 3, (0, 0)) == "whole picture R" and blocks.pixels[-1] == 20 * 28
    spread = blocks.spread(vector)
    assert spread.shape == SHAPE and (spread[8:16, 24:28, 2] == vector[i]).all()
    grey = Blocks((5, 7), 4)
    assert grey.name(3, (0, 0)) == "x=4..6 y=4..4" and grey.spread(grey.means(REFERENCE[:5, :7, 0])).shape == (5, 7)


def test_noise_is_no_bias_and_the_verdict_is_that_of_an_independent_test() -> None:
    found = assert_unbiased(noisy, REFERENCE, seeds=12, block=4)
    images = np.stack([noisy(seed) for seed in range(12)])
    means = images.reshape(12, 5, 4, 7, 4, 3).mean(axis=(2, 4)).reshape(12, -1)
    means = np.concatenate([means, images.mean(axis=(1, 2))], axis=1)
    expected = REFERENCE.reshape(5, 4, 7, 4, 3).mean(axis=(1, 3)).ravel()
    expected = np.concatenate([expected, REFERENCE.mean(axis=(0, 1))])
    p = stats.ttest_1samp(means, expected).pvalue
    assert found.tests == len(p) == 5 * 7 * 3 + 3
    assert found.smallest_p == pytest.approx(p.min(), rel=1e-3)
    assert found.threshold == pytest.approx(1 - 0.99 ** (1 / len(p)))
    shares = means[:, -3:].std(axis=0, ddof=1) / np.sqrt(12) / expected[-3:]
    assert found.standard_error == pytest.approx(shares.max(), rel=1e-3)


def test_a_correct_method_fails_as_often_as_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    """300 families at significance 0.2; 4 standard deviations of a binomial on either side."""
    monkeypatch.setattr("lab.testing.bias.leave_evidence", lambda *_, **__: "")  # pictures of 60 failures take time
    grey = REFERENCE[..., 0]

    def refused(trial: int) -> bool:
        rng = np.random.default_rng([trial, 1])
        try:
            assert_unbiased(
                lambda seed: grey + rng.normal(0, 0.1, grey.shape), grey, seeds=6, significance=0.2, block=10
            )
        except AssertionError:
            return True
        return False

    count = sum(refused(trial) for trial in range(300))
    assert abs(count - 300 * 0.2) < 4 * np.sqrt(300 * 0.2 * 0.8)


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_bias_of_one_block_is_found_and_named(factor: float, tmp_path: Path) -> None:
    def biased(seed: int) -> np.ndarray:
        image = noisy(seed)
        image[8:16, 16:24, 1] *= factor
        return image

    with pytest.raises(AssertionError) as caught:
        assert_unbiased(biased, REFERENCE, evidence=tmp_path)
    lines = str(caught.value).splitlines()
    assert re.fullmatch(r"image is biased: \d+ of 39 means differ from the reference", lines[0])
    expected = REFERENCE[8:16, 16:24, 1].mean()
    first = re.fullmatch(
        r"  differs   x=16\.\.23 y=8\.\.15 G: ([\d.]+), reference ([\d.]+) "
        r"\(([-+][\d.]+) %\), ([\d.]+) standard errors, p = ([\d.e-]+)",
        lines[2],
    )
    assert first, lines[2]
    assert float(first[2]) == pytest.approx(expected, rel=1e-3)
    assert float(first[1]) == pytest.approx(factor * expected, rel=0.02)
    assert float(first[3]) == pytest.approx(100 * (factor - 1), abs=2) and float(first[5]) < 1e-4
    assert "16 seeds, p below 0.00026 each (0.01 over all)" in lines[1]
    layers = read_exr(tmp_path / "evidence.exr")
    assert (layers["p_value"][8:16, 16:24, 1] == layers["p_value"].min()).all()
    np.testing.assert_allclose(layers["image"], np.mean([biased(seed) for seed in range(16)], axis=0), rtol=1e-6)
    numbers = json.loads((tmp_path / "evidence.json").read_text())
    assert numbers["tests"] == 39 and numbers["smallest_p"] == pytest.approx(float(first[5]), rel=0.1)
    assert (tmp_path / "blocks.png").is_file() and str(tmp_path) in lines[-1]
    # It lies in that block alone.
    assert_unbiased(biased, REFERENCE, region=(0, 0, 16, 20))
    assert_unbiased(biased, REFERENCE, region=(0, 16, 28, 4))
    with pytest.raises(AssertionError, match=r"x=16\.\.23 y=8\.\.15 G"):
        assert_unbiased(biased, REFERENCE, region=(16, 8, 8, 8))


def test_a_bias_too_small_for_a_block_is_found_in_the_whole() -> None:
    with pytest.raises(AssertionError, match=r"1 of 25 means differ (.|\n)*differs   whole picture: "):
        assert_unbiased(lambda seed: noisy(seed, 0.5)[..., 0] * 1.02, REFERENCE[..., 0], seeds=20, block=5)


def test_the_noise_of_the_reference_counts() -> None:
    rng = np.random.default_rng(4)
    deviation = 0.3 * REFERENCE
    blurred = REFERENCE + rng.normal(0, 1, SHAPE) * deviation
    with pytest.raises(AssertionError, match="is biased"):
        assert_unbiased(lambda seed: noisy(seed, 0.02), blurred)
    assert_unbiased(lambda seed: noisy(seed, 0.02), blurred, reference_variance=deviation**2)
    with pytest.raises(AssertionError, match="is biased"):
        assert_unbiased(lambda seed: noisy(seed, 0.02), blurred, reference_variance=0.04 * deviation**2)


def test_two_methods_are_compared_over_different_seeds() -> None:
    seen = []

    def other(seed: int) -> np.ndarray:
        seen.append(seed)
        return noisy(seed, 0.4)

    assert_unbiased(noisy, other, seeds=8)
    assert len(set(seen)) == 8 and not set(seen) & set(range(8)) and max(seen) < 2**32
    with pytest.raises(AssertionError, match="is biased"):
        assert_unbiased(noisy, lambda seed: 1.2 * other(seed), seeds=8)


def test_without_noise_rounding_is_no_bias_but_anything_else_is() -> None:
    single = REFERENCE.astype(np.float32)
    assert assert_unbiased(lambda seed: single, REFERENCE).standard_error < 1e-6
    with pytest.raises(AssertionError, match=r"all seeds gave the same picture: is the seed used\?"):
        assert_unbiased(lambda seed: single * 1.0001, REFERENCE)
    black = np.zeros((8, 8))
    assert assert_unbiased(lambda seed: black, black).smallest_p == 1
    with pytest.raises(AssertionError, match="p = 0"):
        assert_unbiased(lambda seed: black + 1e-9, black)


def test_what_is_no_picture_or_number_is_refused() -> None:
    spoilt = REFERENCE.copy()
    spoilt[3, 4] = np.nan
    with pytest.raises(
        AssertionError, match="image of seed 2: 1 of 560 pixels are not finite; the first is at x=4 y=3"
    ):
        assert_unbiased(lambda seed: spoilt if seed == 2 else REFERENCE, REFERENCE)
    with pytest.raises(AssertionError, match="reference: 1 of 560 pixels are not finite"):
        assert_unbiased(noisy, spoilt)
    sizes = [(lambda seed: REFERENCE[: 20 - seed]), lambda seed: REFERENCE[1:]]
    with pytest.raises(LabError, match="image of seed 1 has 28x19 RGB pixels"):
        assert_unbiased(sizes[0], REFERENCE)
    with pytest.raises(LabError, match="image has 28x19 RGB pixels and its reference 28x20 RGB"):
        assert_unbiased(sizes[1], REFERENCE, region=(0, 0, 4, 4))
    for wrong, said in (
        ({"seeds": 2}, "seeds=2: expected a whole number of 3 or more"),
        ({"block": 0}, "block=0"),
        ({"significance": 0.0}, "significance=0.0 must lie between 0 and 1"),
        ({"region": (0, 0, 99, 1)}, "lie in a picture of 28x20 pixels"),
        ({"reference_variance": np.ones((2, 2))}, "reference_variance: expected a number, or a picture"),
        ({"reference_variance": -1.0}, "every value must be finite and 0 or more"),
        ({"reference_variance": np.inf}, "every value must be finite and 0 or more"),
    ):
        with pytest.raises(LabError, match=re.escape(said)):
            assert_unbiased(noisy, REFERENCE, **wrong)
