"""The window of ``lab view``, opened on a virtual screen: what is seen, and what keys, mouse and panel do."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lab.engine import STAGES

from ..conftest import write_quads


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("visit")


@pytest.fixture(scope="module")
def visit(gpu: Any, folder: Path) -> dict[str, Any]:
    """What :mod:`tests.unit.window_visit` found out. In a process of its own: a lost display ends the process."""
    if shutil.which("xvfb-run") is None:
        missing = "xvfb-run is not installed, no window can be opened: apt-get install xvfb xauth"
        pytest.fail(missing) if os.environ.get("CI") == "true" else pytest.skip(missing)
    scene = write_quads(folder / "quads")
    done = subprocess.run(
        [
            "xvfb-run", "-a", "-s", f"-screen 0 640x480x24 -fbdir {folder}", sys.executable, "-W", "error", "-m",
            "tests.unit.window_visit", str(folder), str(scene),
        ],
        capture_output=True, text=True, check=False, timeout=240, cwd=Path(__file__).parents[2],
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    found: dict[str, Any] = json.loads((folder / "visit.json").read_text())
    return found | {"stdout": done.stdout, "stderr": done.stderr}


def test_the_screen_shows_the_picture_of_lab_render(visit: dict[str, Any]) -> None:
    assert visit["colours"] > 1000
    assert visit["picture"] <= 1
    assert visit["without_panel"] <= 1, "as it is on the screen: encoded once"
    assert visit["with_panel"] > 50, "the panel lies over it"
    assert visit["medians"] == [*STAGES, "present", "frame"]


def test_keys_and_mouse_fly(visit: dict[str, Any]) -> None:
    assert 0.001 < visit["moved"] < 2
    assert visit["read_back"] == 0, "frames stay on the device"
    assert visit["looked"] > 1
    assert visit["faster"] == pytest.approx(1.25)
    assert visit["back"] <= 1


def test_layers_by_keys(visit: dict[str, Any]) -> None:
    assert visit["layer"] == "shadow_ratio_noisy"
    assert visit["overdraw"][0] == visit["overdraw"][1] > 1


def test_the_picture_fills_a_window_of_another_size(visit: dict[str, Any]) -> None:
    assert visit["resized"] == [64, 120, 3]


def test_the_panel_changes_settings(visit: dict[str, Any]) -> None:
    assert visit["settings"] == [0.1, "none", "none"]
    assert visit["shown"] == ["* alpha", 0.1]
    assert visit["preset"] == ["paper", "mean"]
    assert visit["typed"] == [7, "shadow_ratio"]


def test_what_goes_wrong_is_said_in_the_panel(visit: dict[str, Any]) -> None:
    shown, message, alpha = visit["refused"]
    assert shown and "alpha=-1" in message and alpha == 0.1
    assert visit["failed"] == ["! no frame can have these", 0.1]


def test_escape_ends_it_with_the_picture_saved(visit: dict[str, Any], folder: Path) -> None:
    assert visit["running"] is False
    printed, saved = visit["said"]
    assert printed.startswith("--camera ") and "[[camera]]" in printed and saved.endswith("saved.png")
    with Image.open(folder / "saved.png") as picture:
        assert picture.size == (160, 90)
        assert picture.text["layer"] == "shadow_ratio"  # type: ignore[attr-defined]
        assert json.loads(picture.text["params"])["seed"] == 7  # type: ignore[attr-defined]


def test_the_command_saves_what_lab_render_writes(visit: dict[str, Any], folder: Path) -> None:
    assert visit["code"] == visit["render"] == 0
    assert visit["stderr"] == ""
    assert "2 frames" in visit["stdout"] and "trace_shadow_rays" in visit["stdout"]
    shown, rendered = (np.asarray(Image.open(folder / name)).astype(int) for name in ("command.png", "render.png"))
    assert shown.shape == (90, 160, 3) and np.abs(shown - rendered).max() <= 1
