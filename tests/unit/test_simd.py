"""One binary, several instruction sets: the same picture within rounding, whichever is in use."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import lab
from lab import LabError, _core
from lab.engine.cpu import CpuEngine
from lab.engine.simd import set_simd, use_simd_of_environment

CHOICES: list[str] = _core.info()["simd_choices"]
PARAMS = lab.Params(vpls=3000, levels=4, picker="race")


@pytest.fixture(autouse=True)
def restored() -> Iterator[None]:
    before = _core.info()["simd"]
    yield
    _core.set_simd(before)


@pytest.fixture(scope="module")
def engine() -> CpuEngine:
    return CpuEngine(lab.load_scene("scenes/cornell/scene.toml"))


def render(engine: CpuEngine) -> lab.Frame:
    return lab.render(engine.scene, PARAMS, size=(96, 64), engine=engine)


def test_the_best_is_in_use_and_every_choice_can_be_had() -> None:
    assert CHOICES
    assert len(set(CHOICES)) == len(CHOICES)
    for name in CHOICES:
        _core.set_simd(name)
        assert _core.info()["simd"] == name
        assert _core.info()["simd_choices"] == CHOICES


@pytest.mark.skipif(len(CHOICES) < 2, reason="this processor has one instruction set")
@pytest.mark.parametrize("name", CHOICES[1:])
def test_a_frame_is_the_same_within_rounding(engine: CpuEngine, name: str) -> None:
    best = render(engine)
    set_simd(name)
    other = render(engine)
    # The grid's sums are integers: no instruction set may change them.
    np.testing.assert_array_equal(other.hierarchy.flux, best.hierarchy.flux)
    np.testing.assert_array_equal(other.hierarchy.position, best.hierarchy.position)
    scale = float(best.lighting.irradiance.mean())
    np.testing.assert_allclose(other.lighting.irradiance, best.lighting.irradiance, rtol=1e-4, atol=1e-5 * scale)
    same = other.lighting.light == best.lighting.light  # the race compares keys: rounding decides only ties
    assert same.mean() > 0.999
    # A pixel whose pick changed spreads through the filter.
    close = np.isclose(other.image.indirect, best.image.indirect, rtol=1e-3, atol=1e-4 * best.image.indirect.mean())
    assert close.mean() > 0.98


def test_a_run_in_one_set_is_the_same_to_the_bit(engine: CpuEngine) -> None:
    set_simd(CHOICES[-1])
    np.testing.assert_array_equal(render(engine).image.colour, render(engine).image.colour)


def test_an_unknown_set_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LabError, match=rf"mmx.*have .*{CHOICES[0]}"):
        set_simd("mmx")
    monkeypatch.setenv("LAB_SIMD", "mmx")
    with pytest.raises(LabError, match=r"LAB_SIMD.*unset it"):
        use_simd_of_environment()
    assert _core.info()["simd"] in CHOICES


def test_the_environment_chooses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_SIMD", CHOICES[-1])
    use_simd_of_environment()
    assert _core.info()["simd"] == CHOICES[-1]
