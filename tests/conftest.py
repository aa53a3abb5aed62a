"""Fixtures of every test: where the repository and the shared scenes are, and a tiny scene that renders at once."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

ROOT = Path(__file__).resolve().parent.parent


# CI tries the same examples every time, so that it judges the change and not the day; elsewhere each run looks further.
hypothesis.settings.register_profile("ci", derandomize=True, print_blob=True)
if os.environ.get("CI") == "true":
    hypothesis.settings.load_profile("ci")


@pytest.fixture(scope="session")
def root() -> Path:
    """The top of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared_scenes() -> Path:
    """The folder of the shared test scenes, from LAB_SCENES; without it the test skips, but never where CI is set."""
    folder = os.environ.get("LAB_SCENES", "")
    if not folder:
        if os.environ.get("CI") == "true":
            pytest.fail("CI=true but LAB_SCENES is not set: it must name the folder of the shared test scenes")
        pytest.skip("LAB_SCENES is not set: name the folder of the shared test scenes to run this")
    path = Path(folder)
    if not path.is_dir():
        pytest.fail(f"LAB_SCENES={folder} is no folder")
    return path


def write_quads(folder: Path, **changes: str) -> Path:
    """A floor and a wall behind it, lit by a sun, as `folder`/scene.toml; `changes` replace its blocks of text."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "quads.obj").write_text(
        "v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\n"
        "v -2 2 -2\nv 2 2 -2\n"
        "f 4 3 2 1\nf 1 2 6 5\n"
    )  # fmt: skip
    blocks = {
        "head": 'name = "quads"\nexposure = 1.0\ngeometry = ["quads.obj"]\n',
        "camera": '[[camera]]\nname = "front"\neye = [0.0, 1.0, 4.0]\ntarget = [0.0, 0.6, 0.0]\nfov_y_deg = 50.0\n',
        "side": '[[camera]]\nname = "side"\neye = [3.0, 2.0, 3.0]\ntarget = [0.0, 0.0, 0.0]\nfov_y_deg = 60.0\n',
        "sun": "[[sun]]\nto_sun = [0.3, 1.0, 0.6]\nirradiance = [3.0, 2.8, 2.5]\n",
    } | changes
    path = folder / "scene.toml"
    path.write_text("".join(blocks.values()))
    return path


@pytest.fixture
def quads(tmp_path: Path) -> Path:
    """The tiny scene of :func:`write_quads`, in a folder of its own."""
    return write_quads(tmp_path / "quads")


@pytest.fixture
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder that the test works in."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture(scope="session")
def gpu() -> Iterator[object]:
    """The first Vulkan device; without one the test skips and says why, but never where LAB_REQUIRE_VULKAN is set."""
    from lab.engine.vulkan.device import Gpu
    from lab.errors import LabError

    try:
        device = Gpu(os.environ.get("LAB_TEST_DEVICE", ""))
    except LabError as error:
        if os.environ.get("LAB_REQUIRE_VULKAN", "") not in ("", "0"):
            pytest.fail(f"LAB_REQUIRE_VULKAN is set, but: {error}")
        pytest.skip(str(error))
    yield device
    device.close()
