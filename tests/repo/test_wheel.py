"""A wheel has everything that the package reads while it runs: shaders, pages of the inspector, its own sources."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from .project import ROOT, files

BUILD = "import sys, scikit_build_core.build as b; b.build_wheel(sys.argv[1], {'wheel.cmake': 'false'})"


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of this tree without the compiled core, unpacked."""
    folder = tmp_path_factory.mktemp("wheel")
    done = subprocess.run(
        [sys.executable, "-c", BUILD, str(folder)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


@pytest.mark.parametrize(("source", "place"), [("shaders", "lab/shaders"), ("lab", "lab"), ("gui", "gui")])
def test_nothing_is_left_out(unpacked: Path, source: str, place: str) -> None:
    wanted = {path.relative_to(source) for path in files() if path.is_relative_to(source)}
    there = {path.relative_to(unpacked / place) for path in (unpacked / place).rglob("*") if path.is_file()}
    assert len(wanted) > 10
    assert wanted - there == set()


def test_the_shaders_of_a_wheel_are_found(unpacked: Path) -> None:
    script = "from lab.engine.vulkan.program import SHADERS; print(SHADERS, (SHADERS / 'passes').is_dir())"
    # -S: an editable installation would hand out the tree instead.
    done = subprocess.run(
        [sys.executable, "-S", "-c", script],
        cwd=unpacked,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(unpacked), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == [str(unpacked.resolve() / "lab" / "shaders"), "True"], done.stderr
