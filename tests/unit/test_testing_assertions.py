"""The assertions on one picture: they pass and fail where they should, and leave evidence that can be read."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lab.errors import LabError
from lab.image_io import read_exr, read_exr_attributes
from lab.testing import assert_energy, assert_images_close

from .inner_pytest import evidence, load_everything, run

pytest_plugins = "pytester"

FILES = ["error.png", "evidence.exr", "evidence.json", "images.png"]


@pytest.fixture(scope="module", autouse=True)
def loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """All modules, before the first inner run."""
    load_everything(tmp_path_factory.mktemp("loading"))


@pytest.fixture
def reference() -> np.ndarray:
    return np.random.default_rng(1).uniform(0.1, 2.0, (18, 32, 3))


@pytest.fixture
def noisy(reference: np.ndarray) -> np.ndarray:
    return reference * np.random.default_rng(2).uniform(0.9, 1.12, reference.shape)


def rel_mse(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.mean((a - b) ** 2 / (b**2 + (0.01 * b.mean()) ** 2)))


def refusal(check: Callable[[], object], folder: Path) -> str:
    """The message of a check that must fail, whose evidence must lie in `folder`."""
    with pytest.raises(AssertionError) as caught:
        check()
    message = str(caught.value)
    assert f"evidence  {folder}: images.png, error.png" in message
    return message


def test_the_threshold_is_the_relative_error(noisy: np.ndarray, reference: np.ndarray, tmp_path: Path) -> None:
    exact = rel_mse(noisy, reference)
    assert_images_close(noisy, reference, rel_mse=exact * 1.001)
    message = refusal(lambda: assert_images_close(noisy, reference, rel_mse=exact * 0.999, evidence=tmp_path), tmp_path)
    assert message.startswith("image and reference are not close: relMSE\n")
    assert f"relMSE    {exact:.4g}, at most {exact * 0.999:g} allowed <- too much" in message
    ratios = [noisy[..., i].sum() / reference[..., i].sum() for i in range(3)]
    assert "R {:.4g}, G {:.4g}, B {:.4g}".format(*ratios) in message


def test_only_what_is_too_much_is_blamed(noisy: np.ndarray, reference: np.ndarray, tmp_path: Path) -> None:
    message = refusal(lambda: assert_images_close(noisy, reference, rel_mse=1, flip=1e-4, evidence=tmp_path), tmp_path)
    assert message.startswith("image and reference are not close: FLIP\n") and message.count("<- too much") == 1
    assert_images_close(noisy, reference, rel_mse=1, flip=1)


def test_the_worst_place_is_named(reference: np.ndarray, tmp_path: Path) -> None:
    image = reference.copy()
    image[4:6, 20:24] *= 1.5
    before, after = reference[4:6, 20:24].mean(), image[4:6, 20:24].mean()
    place = f"x=20..23 y=3..5: {image[3:6, 20:24].mean():.4g}, reference {reference[3:6, 20:24].mean():.4g} (+"
    assert after > 1.4 * before
    for check in (
        lambda: assert_images_close(image, reference, rel_mse=1e-4, evidence=tmp_path / "a"),
        lambda: assert_energy(image, reference, within=1e-4, evidence=tmp_path / "b"),
    ):
        with pytest.raises(AssertionError, match=re.escape(place)):
            check()


def test_energy_counts_both_ways(reference: np.ndarray, tmp_path: Path) -> None:
    for factor in (0.9801, 1.0199):
        assert_energy(factor * reference, reference)
    for factor, word in ((0.9799, "loses"), (1.0201, "gains")):
        message = refusal(
            lambda f=factor: assert_energy(f * reference, reference, evidence=tmp_path / str(f)), tmp_path / str(factor)
        )
        assert message.startswith(f"image {word} light: {factor:.4g} of the reference's energy, 1 +- 0.02 allowed")
    # Errors that take each other away are no loss of energy, but an error.
    checker = np.where(np.indices((18, 32)).sum(axis=0) % 2, 1.5, 0.5)[..., None] * np.ones(3)
    assert_energy(checker, np.ones((18, 32, 3)))
    with pytest.raises(AssertionError):
        assert_images_close(checker, np.ones((18, 32, 3)), rel_mse=0.2)


def test_only_the_region_counts(reference: np.ndarray, tmp_path: Path) -> None:
    image = reference.copy()
    image[5:9, 10:17] = 0
    for region in ((0, 0, 10, 18), (17, 0, 15, 18), (0, 0, 32, 5), (0, 9, 32, 9)):
        assert_images_close(image, reference, rel_mse=0, flip=0, region=region)
        assert_energy(image, reference, within=0, region=region)
    message = refusal(
        lambda: assert_energy(image, reference, within=0.9, region=(10, 5, 7, 4), evidence=tmp_path), tmp_path
    )
    y, x = np.unravel_index(np.argmax(reference[5:9, 10:17].sum(axis=2)), (4, 7))
    assert f"worst at  x={x + 10}..{x + 10} y={y + 5}..{y + 5}: 0, reference " in message
    assert read_exr(tmp_path / "evidence.exr")["reference"].shape == (4, 7, 3)
    assert json.loads((tmp_path / "evidence.json").read_text())["corner"] == [10, 5]


@pytest.mark.parametrize("shape", [(18, 32), (18, 32, 1), (1, 1), (1, 40, 3)])
def test_any_picture_will_do(shape: tuple[int, ...], tmp_path: Path) -> None:
    reference = np.random.default_rng(5).uniform(0.5, 1, shape)
    assert_images_close(reference, reference, rel_mse=0)
    refusal(lambda: assert_energy(reference.astype(np.float32) * 2, reference, evidence=tmp_path), tmp_path)
    assert read_exr(tmp_path / "evidence.exr")["image"].shape == (shape[:2] if shape[-1] != 3 else shape)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("spoilt", ["image", "reference"])
def test_a_value_that_is_no_number_never_passes(reference: np.ndarray, value: float, spoilt: str) -> None:
    pictures = {"image": reference.copy(), "reference": reference.copy()}
    pictures[spoilt][7, 3, 1] = pictures[spoilt][9, 30, 0] = value
    said = rf"{spoilt}: 2 of 576 pixels are not finite; the first is at x=3 y=7: \["
    with pytest.raises(AssertionError, match=said):
        assert_images_close(**pictures, rel_mse=1e9)
    with pytest.raises(AssertionError, match=said):
        assert_energy(**pictures, within=1e9)
    with pytest.raises(AssertionError, match=f"{spoilt}: 1 of 4 pixels are not finite; the first is at x=3 y=7"):
        assert_energy(**pictures, within=1e9, region=(2, 6, 2, 2))
    assert_energy(**pictures, region=(0, 0, 3, 18))


def test_black_is_black(reference: np.ndarray, tmp_path: Path) -> None:
    black = np.zeros_like(reference)
    assert_images_close(black, black, rel_mse=0, flip=0)
    with pytest.raises(AssertionError, match="gains light: inf of the reference's energy"):
        assert_energy(reference, black, evidence=tmp_path)
    assert json.loads((tmp_path / "evidence.json").read_text())["energy_ratio"] == "inf"
    with pytest.raises(AssertionError, match=r"relMSE    (inf|[0-9.]+e[+][0-9]+), at most"):
        assert_images_close(reference, black, rel_mse=1e6, evidence=tmp_path / "more")
    assert (tmp_path / "more" / "error.png").is_file()


def test_what_can_not_be_compared_is_bad_input(reference: np.ndarray) -> None:
    frame = type("Frame", (), {"image": None, "gbuffer": None})()
    mistakes = [
        (lambda: assert_images_close(reference, reference), "give a threshold, rel_mse= or flip="),
        (lambda: assert_images_close(reference, reference, rel_mse=-1), "rel_mse=-1: a threshold is a number of 0"),
        (lambda: assert_energy(reference, reference, within=np.nan), "within=nan: a threshold"),
        (lambda: assert_energy(reference, reference[1:]), "image has 32x18 RGB pixels and its reference 32x17 RGB"),
        (lambda: assert_energy(reference, reference[..., 0]), "and its reference 32x18 grey"),
        (lambda: assert_energy(reference, reference, region=(0, 0, 33, 1)), "lie in a picture of 32x18 pixels"),
        (lambda: assert_energy(reference, reference, region=(0, 0, 0, 1)), "region=(0, 0, 0, 1): expected (x, y"),
        (lambda: assert_energy(reference, reference, region=(0, 0, 5)), "expected (x, y, width, height)"),
        (lambda: assert_energy(reference[0, 0], reference), "image: expected shape (height, width, 3)"),
        (lambda: assert_energy(reference, "picture.exr"), "reference: expected numbers of shape"),
        (lambda: assert_energy(frame, reference), "image is a whole Frame: give one layer of it, for example .image."),
    ]
    for check, said in mistakes:
        with pytest.raises(LabError, match=re.escape(said)):
            check()


def test_evidence_holds_what_was_compared(noisy: np.ndarray, reference: np.ndarray, tmp_path: Path) -> None:
    message = refusal(lambda: assert_energy(noisy, reference, within=0, evidence=tmp_path), tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == FILES
    layers = read_exr(tmp_path / "evidence.exr")
    np.testing.assert_allclose(layers["image"], noisy, rtol=1e-6)
    np.testing.assert_allclose(layers["reference"], reference, rtol=1e-6)
    expected = (noisy - reference) / np.sqrt(reference**2 + (0.01 * reference.mean()) ** 2)
    np.testing.assert_allclose(layers["error"], expected, rtol=1e-4, atol=1e-6)
    assert read_exr_attributes(tmp_path / "evidence.exr")["failure"] == message.splitlines()[0]
    numbers = json.loads((tmp_path / "evidence.json").read_text())
    assert numbers["energy_ratio"] == pytest.approx(noisy.sum() / reference.sum())
    for name in ("images.png", "error.png"):
        with Image.open(tmp_path / name) as picture:
            picture.load()
            assert picture.size[0] > 500 and picture.text["failure"] == numbers["failure"]
    # The error is drawn in the colours of its sign: brighter is red, darker is blue.
    for factor, redder in ((1.5, True), (0.5, False)):
        refusal(
            lambda f=factor: assert_energy(f * reference, reference, evidence=tmp_path / str(f)), tmp_path / str(factor)
        )
        with Image.open(tmp_path / str(factor) / "error.png") as picture:
            red, _, blue = np.asarray(picture.convert("RGB"), float)[300, 500]
        assert (red > blue + 50) if redder else (blue > red + 50)


def test_evidence_that_can_not_be_written_hides_no_failure(reference: np.ndarray, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(AssertionError, match=r"loses light(.|\n)*evidence  could not be written \(.*file"):
        assert_energy(0.5 * reference, reference, evidence=tmp_path / "file")


def test_under_pytest_evidence_lies_with_the_test(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    body = """
        GOOD = False
        IMAGE = np.random.default_rng(0).uniform(1, 2, (9, 16, 3))

        @pytest.mark.parametrize("factor", [0.5, 1])
        def test_energy(factor):
            assert_energy((1 if GOOD else factor) * IMAGE, IMAGE)

        def test_two_in_one():
            for factor in (0.5, 0.6):
                with pytest.raises(AssertionError):
                    assert_energy(factor * IMAGE, IMAGE)
            assert GOOD

        def test_expected_failures_leave_nothing():
            with pytest.raises(AssertionError, match="evidence"):
                assert_energy(0.5 * IMAGE, IMAGE)

        @pytest.mark.skipif(GOOD, reason="")
        def test_hidden_frames():
            assert_images_close(IMAGE, 2 * IMAGE, rel_mse=0.1)
    """
    result = run(pytester, monkeypatch, body)
    result.assert_outcomes(passed=2, failed=3)
    second = [re.sub(r"\.", "-2.", name) for name in FILES]
    assert evidence(pytester) == sorted(
        [".gitignore"]
        + [f"test_experiment.py/test_energy[0.5]/{name}" for name in FILES]
        + [f"test_experiment.py/test_hidden_frames/{name}" for name in FILES]
        + [f"test_experiment.py/test_two_in_one/{name}" for name in FILES + second]
    )
    shown = result.stdout.str()
    assert f"evidence  {pytester.path / '.lab-evidence' / 'test_experiment.py' / 'test_energy[0.5]'}: images" in shown
    assert ">       assert_images_close(IMAGE, 2 * IMAGE, rel_mse=0.1)" in shown
    ends = [line for line in result.outlines if line.endswith(": AssertionError")]
    assert len(ends) == 3 and all(line.startswith("test_experiment.py:") for line in ends), "no frame of ours is shown"
    result = run(pytester, monkeypatch, body.replace("GOOD = False", "GOOD = True"))
    result.assert_outcomes(passed=4, skipped=1)
    assert evidence(pytester) == [], "not even of a test that is skipped now"
