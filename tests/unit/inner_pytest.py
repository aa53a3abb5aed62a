"""Running pytest with the lab's plugin inside a test, on a tiny scene."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from ..conftest import write_quads

HEADER = """
import numpy as np
import pytest
import lab
from lab.testing import assert_energy, assert_images_close, assert_unbiased

SETTINGS = lab.Params(vpls=100, direct_samples=1, shadow_samples=2)
"""


def load_everything(folder: Path) -> None:
    """Imports, by use, all that an experiment imports; to be called before the fixture `pytester` is made.

    That forgets the modules that were first imported under it, and compiled ones can't be imported twice.
    """
    import numpy.fft
    import numpy.testing
    import scipy.special

    import lab
    from lab.reference import Budget, render_reference
    from lab.testing import assert_energy, assert_images_close, assert_unbiased

    scene = lab.load_scene(write_quads(folder / "quads"))
    image = lab.render(scene, lab.Params(vpls=10), size=(8, 4)).image.colour
    for method in ("brute_force", "path_tracer"):
        render_reference(scene, method, lab.Params(vpls=10), size=(8, 4), budget=Budget(spp=2), cache=False)
    assert_images_close(image, image, rel_mse=0, flip=0)
    assert_unbiased(lambda seed: image, image, seeds=3)
    with pytest.raises(AssertionError):
        assert_energy(2 * image, image, evidence=folder / "evidence")
    assert numpy.fft and numpy.testing and scipy.special  # loaded by others when first used


def run(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, body: str, *args: str) -> pytest.RunResult:
    """Runs `body` as test_experiment.py, beside quads/scene.toml, with no plugin but the lab's."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("LAB_CACHE", str(pytester.path / "cache"))
    write_quads(pytester.path / "quads")
    (pytester.path / "test_experiment.py").write_text(HEADER + textwrap.dedent(body), encoding="utf-8")
    plain = ["-p", "lab.testing.plugin", "-p", "no:cacheprovider", "-W", "error", "--strict-markers"]
    return pytester.runpytest_inprocess(*plain, *args)


def evidence(pytester: pytest.Pytester, root: str = ".lab-evidence") -> list[str]:
    """Every file that evidence was left in."""
    folder = pytester.path / root
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
