"""The workbench: settings with undo, frames that redo only what a change touches, and the frame elsewhere."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from gui.view_state import ViewState
from gui.workbench import Workbench, command_line, python_code
from lab import LabError
from lab.cli import main
from lab.image_io import read_exr

SMALL = lab.Params(vpls=300, direct_samples=1)


def silent(stage: str) -> None:
    """Progress nobody watches."""


@pytest.fixture
def bench(quads: Path) -> Iterator[Workbench]:
    bench = Workbench(ViewState(scene=str(quads), params=SMALL.to_dict(), size=(48, 32)))
    yield bench
    bench.close()


def test_a_frame_is_what_the_library_renders(bench: Workbench) -> None:
    settings = bench.change(alpha=2, camera="side")
    frame = bench.render(settings, silent)
    expected = lab.render(bench.scene, settings.params, camera="side", size=(48, 32))
    assert np.array_equal(frame.image.colour, expected.image.colour)
    assert np.array_equal(frame.lighting.counts()[0], expected.lighting.counts()[0])


def test_only_what_changed_is_done(bench: Workbench) -> None:
    bench.render(bench.settings, silent)
    seen: list[str] = []
    frame = bench.render(bench.change(filter="none"), seen.append)
    assert frame.stages_ms["light"] < 1 and frame.stages_ms["trace_shadow_rays"] < 1
    before = bench.render(bench.change(alpha=3), silent)
    assert before.hierarchy is frame.hierarchy and before.lighting is not frame.lighting


def test_undo_and_redo_travel_and_a_new_step_forgets_the_future(bench: Workbench) -> None:
    first = bench.settings
    bench.change(alpha=2)
    bench.change(alpha=2)  # nothing changed: no step
    assert bench.steps == (1, 0)
    second = bench.change(size=(64, 32))
    assert bench.undo() != second and bench.undo() == first and bench.undo() == first
    assert bench.steps == (0, 2)
    bench.redo()
    assert bench.redo() == second
    bench.undo()
    bench.choose_preset("paper")
    assert bench.steps == (2, 0) and bench.settings.params.lobe == "mean" and bench.settings.params.vpls == 300
    assert bench.reset().params == lab.preset("paper")


@pytest.mark.parametrize("change", [{"alpha": 0}, {"alhpa": 1}, {"camera": "frnt"}, {"camera": "1,2:3"}])
def test_a_refused_change_changes_nothing(bench: Workbench, change: dict[str, Any]) -> None:
    before = bench.settings
    with pytest.raises(LabError):
        bench.change(**change)
    assert bench.settings == before and bench.steps == (0, 0)


CHANGES: dict[str, dict[str, Any]] = {
    "defaults": {},
    "settings": {"alpha": 1.5, "importance": False, "levels": 3, "filter": "none"},
    "a named camera": {"camera": "side"},
    "a camera of numbers": {"camera": "-3,2,3:0,0,0:0,1,0:50"},
}


@pytest.mark.parametrize("name", CHANGES)
def test_the_frame_elsewhere_is_the_same(
    bench: Workbench, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    settings = bench.change(**CHANGES[name])
    colour = bench.render(settings, silent).image.colour
    changed, scene = bench.changed_settings(), bench.scene.path
    names: dict[str, Any] = {}
    exec(python_code(scene, settings, changed), names)
    assert np.array_equal(names["frame"].image.colour, colour)
    command = shlex.split(command_line(scene, settings, changed))
    assert command[0] == "lab" and main([*command[1:], "-o", "again", "--quiet"]) == 0
    assert np.array_equal(read_exr("again.exr")["colour"], colour)


def test_the_sun_goes_along(quads: Path) -> None:
    bench = Workbench(ViewState(scene=str(quads), sun="1,1,0", params=SMALL.to_dict(), size=(24, 16)))
    names: dict[str, Any] = {}
    exec(python_code(str(quads), bench.settings, bench.changed_settings(), "1,1,0"), names)
    assert np.array_equal(names["frame"].image.colour, bench.render(bench.settings, silent).image.colour)
    assert "--sun 1,1,0" in command_line(str(quads), bench.settings, {}, "1,1,0")
    bench.close()


def test_bad_scenes_and_cameras_are_refused(quads: Path, tmp_path: Path) -> None:
    with pytest.raises(LabError, match="front"):
        Workbench(ViewState(scene=str(quads), camera="frnt"))
    with pytest.raises(LabError):
        Workbench(ViewState(scene=str(tmp_path / "none.glb")))
