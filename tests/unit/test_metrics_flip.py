"""HDR-FLIP: an independent implementation agrees, and what ends or fools the library it comes from does not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lab.errors import LabError
from lab.metrics import PIXELS_PER_DEGREE, flip, flip_exposures

from ..oracle import hdr_flip as oracle

SHAPE = (20, 28, 3)


def images(kind: str) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    if kind == "noise":
        return rng.random(SHAPE), rng.random(SHAPE)
    if kind == "wide range":
        return np.exp(2 * rng.normal(size=SHAPE)), np.exp(2 * rng.normal(size=SHAPE))
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] / SHAPE[0]
    smooth = np.stack([x, 0.4 + 0.3 * np.sin(5 * y), 0.1 + y * x], axis=-1) * np.where(x > 0.6, 4.0, 0.3)[..., None]
    return smooth * (1 + 0.15 * rng.normal(size=SHAPE)).clip(0), smooth


@pytest.mark.parametrize("kind", ["noise", "wide range", "smooth"])
@pytest.mark.parametrize("pixels_per_degree", [PIXELS_PER_DEGREE, 25.0])
def test_the_papers_formulas_agree(kind: str, pixels_per_degree: float) -> None:
    image, reference = images(kind)
    expected = oracle.hdr_flip(image, reference, pixels_per_degree)
    mean, error_map = flip(image, reference, pixels_per_degree=pixels_per_degree)
    np.testing.assert_allclose(error_map, expected, atol=2e-5)
    assert mean == pytest.approx(expected.mean(), abs=5e-6)


@pytest.mark.parametrize("constant", ["QC", "PC", "PT", "W", "QF"])
def test_the_agreement_would_see_a_wrong_constant(constant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    image, reference = images("smooth")
    monkeypatch.setattr(oracle, constant, getattr(oracle, constant) * 1.03)
    wrong = oracle.hdr_flip(image, reference, PIXELS_PER_DEGREE)
    assert np.abs(flip(image, reference)[1] - wrong).max() > 2e-4


def test_it_is_the_number_that_others_report(capfd: pytest.CaptureFixture[str]) -> None:
    from flip_evaluator import evaluate

    image, reference = (x.astype(np.float32) for x in images("wide range"))
    theirs, mean, settings = evaluate(reference, image, "HDR", applyMagma=False)
    ours = flip(image, reference)
    np.testing.assert_allclose(ours[1], theirs[..., 0], atol=2e-5)
    assert ours[0] == pytest.approx(mean, abs=1e-5)
    exposures = flip_exposures(reference)
    assert exposures is not None
    assert exposures.start == pytest.approx(settings["startExposure"], abs=1e-5)
    assert exposures.stop == pytest.approx(settings["stopExposure"], abs=1e-5)
    assert exposures.steps == settings["numExposures"]
    assert settings["ppd"] == pytest.approx(PIXELS_PER_DEGREE, rel=1e-6)
    assert capfd.readouterr() == ("", "")


def test_no_difference_is_none_and_more_is_more() -> None:
    image, reference = images("smooth")
    assert flip(reference, reference)[0] == 0
    grown = [flip(reference + share * (image - reference), reference)[0] for share in (0, 0.05, 0.2, 0.5, 1)]
    assert grown == sorted(grown) and 0 < grown[1] < grown[-1] < 1
    error_map = flip(np.zeros(SHAPE), reference * 100)[1]
    assert error_map.shape == SHAPE[:2] and error_map.min() >= 0 and error_map.max() <= 1 and error_map.mean() > 0.8


@pytest.mark.parametrize("factor", [1e-300, 1e-35, 1e-5, 1e5, 1e30, 1e300])
def test_the_unit_of_the_radiance_does_not_matter(factor: float) -> None:
    image, reference = images("wide range")
    reference[: SHAPE[0] // 2 + 3] = 0  # More than half is black: the median can't be had from all pixels.
    assert flip(image * factor, reference * factor)[0] == pytest.approx(flip(image, reference)[0], abs=1e-6)


def test_black_images_do_not_end_the_process() -> None:
    image, _ = images("noise")
    black = np.zeros(SHAPE)
    assert flip(black, black)[0] == 0 and flip_exposures(black) is None
    assert flip(image, black)[0] > 0.9
    assert flip(black, image)[0] > 0.9
    assert flip(image - 2, black)[0] == 0, "below 0 is black on any screen"


def test_below_zero_is_black() -> None:
    image, reference = images("smooth")
    for spoilt in (image, reference):
        spoilt[4:6, 3:9] = 0
    wanted = flip(image, reference)[0]
    image[4, 3], reference[5, 8] = -3, -0.5
    assert flip(image, reference)[0] == wanted


def test_a_firefly_is_bright() -> None:
    _, reference = images("smooth")
    burnt = [reference.copy() for _ in range(2)]
    burnt[0][10, 14], burnt[1][10, 14] = 1e9, 1e35
    assert flip(burnt[1], reference)[0] == flip(burnt[0], reference)[0] > 0
    # In the reference it widens the exposures, which stay countable.
    exposures = flip_exposures(burnt[1])
    assert exposures is not None and exposures.stop - exposures.start == exposures.steps == 32
    assert 0 < flip(reference, burnt[1])[0] < 1


def test_exposures_run_from_the_brightest_to_the_median_pixel() -> None:
    reference = np.ones((3, 3, 3)) * 0.25
    reference[0, 0] = 8
    found = flip_exposures(reference)
    near_white = oracle.exposures(np.ones((1, 1, 3)))[0]
    assert found is not None
    assert found.start == pytest.approx(near_white - 3, abs=1e-9) and found.stop == pytest.approx(
        near_white + 2, abs=1e-9
    )
    assert found.steps == math.ceil(5)


def test_what_can_not_be_compared() -> None:
    image, reference = images("noise")
    with pytest.raises(LabError, match=r"\(20, 28\)"):
        flip(image[..., 0], reference[..., 0])
    with pytest.raises(LabError, match="same shape"):
        flip(image[1:], reference)
    for value in (np.nan, np.inf):
        image[3, 3, 1] = value
        with pytest.raises(LabError, match="finite"):
            flip(image, reference)
    with pytest.raises(LabError, match="pixels_per_degree=0"):
        flip(reference, reference, pixels_per_degree=0)
