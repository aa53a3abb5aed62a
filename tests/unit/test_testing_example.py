"""The example experiment can be copied and run elsewhere, and its checks can fail."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.records import Frame
from lab.testing import Renderer

from .inner_pytest import evidence, load_everything, run

pytest_plugins = "pytester"

EXAMPLE = "tests/examples/test_alpha_and_samples.py"
Run = Callable[..., pytest.RunResult]


@pytest.fixture(scope="module", autouse=True)
def loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """All modules, before the first inner run."""
    load_everything(tmp_path_factory.mktemp("loading"))


@pytest.fixture
def experiment(root: Path, pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the example, copied to a folder of its own, on the Cornell box."""
    shutil.copy(root / EXAMPLE, pytester.path)
    scene = str(root / "scenes" / "cornell")
    return lambda *args: run(pytester, monkeypatch, "", f"--lab-scene={scene}", *args)


def test_the_copied_example_passes_and_writes_its_table(experiment: Run, pytester: pytest.Pytester) -> None:
    experiment().assert_outcomes(passed=21)
    table = np.genfromtxt(pytester.path / "out" / "alpha_and_samples.csv", delimiter=",", names=True)
    assert len(table) == 16
    assert {(row["alpha"], row["samples"]) for row in table} == {(a, k) for a in (0.5, 1, 2, 4) for k in (1, 4, 16, 64)}
    best = table[(table["alpha"] == 4) & (table["samples"] == 64)][0]
    assert best["rel_mse"] == table["rel_mse"].min() and 0.95 < best["energy"] < 1.05
    page = (pytester.path / "out" / "alpha_and_samples.md").read_text().splitlines()
    assert page[0] == "| alpha | k = 1 | k = 4 | k = 16 | k = 64 |" and len(page) == 6
    assert page[5].endswith(f" {best['rel_mse']:.3g} ({best['energy']:.2f}) |")
    assert evidence(pytester) == []


def test_a_part_of_it_makes_a_part_of_the_table(experiment: Run, pytester: pytest.Pytester) -> None:
    experiment("-k", "energy_is_kept and 2.0-4").assert_outcomes(passed=1, deselected=20)
    assert len((pytester.path / "out" / "alpha_and_samples.csv").read_text().splitlines()) == 2
    page = (pytester.path / "out" / "alpha_and_samples.md").read_text()
    assert page.splitlines()[2] == "| 0.5 |  |  |  |  |"


def test_its_checks_can_fail(experiment: Run, pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where k does nothing and light is lost, it is seen, and pictures tell where."""
    render = Renderer.__call__

    def broken(self: Renderer, *args: object, **settings: object) -> Frame:
        frame = render(self, *args, **(settings | {"shadow_samples": 4}))
        return replace(frame, image=replace(frame.image, indirect=0.5 * frame.image.indirect))

    monkeypatch.setattr(Renderer, "__call__", broken)
    result = experiment("-k", "falls_with_samples or 2.0-4")
    result.assert_outcomes(failed=5, deselected=16)
    shown = result.stdout.str()
    assert re.search(r"image loses light: 0\.[45]\d* of the reference", shown) and "1 +- 0.1 allowed" in shown
    assert "test_alpha_and_samples.py/test_energy_is_kept[2.0-4]/images.png" in evidence(pytester)
