"""``lab view`` on the command line: what it refuses, and what it teaches."""

from __future__ import annotations

import platform
from pathlib import Path

import pytest

from lab.cli import main
from lab.view.keys import KEYS

from .command_line import refused

REFUSALS = {
    "no scene": ([], "no scene given"),
    "another engine": (["SCENE", "--engine", "cpu"], "lab view works with --engine vulkan alone"),
    "an unknown engine": (["SCENE", "--engine", "vulcan"], "did you mean 'vulkan'"),
    "frames of words": (["SCENE", "--frames", "many"], "--frames many"),
    "no frames": (["SCENE", "--frames", "0"], "--frames 0"),
    "another kind of picture": (["SCENE", "--screenshot", "a.jpg"], "must end in .png"),
    "an unknown setting": (["SCENE", "--set", "alhpa=2"], "did you mean 'alpha'"),
    "an unknown preset": (["SCENE", "--preset", "papre"], "papre"),
    "size": (["SCENE", "--size", "4"], "--size 4"),
    "exposure": (["SCENE", "--exposure", "-1"], "--exposure -1"),
}


@pytest.mark.usefixtures("empty_folder")
@pytest.mark.parametrize("name", REFUSALS)
def test_bad_input_is_refused_in_one_line(quads: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments, word = REFUSALS[name]
    given = [str(quads) if argument == "SCENE" else argument for argument in arguments]
    assert word in refused(["view", *given], capsys)


@pytest.mark.usefixtures("empty_folder")
@pytest.mark.skipif(platform.system() != "Linux", reason="other systems always have a display")
@pytest.mark.parametrize(
    ("display", "word"), [("", "there is no display here"), (":4711", "can't be opened (DISPLAY=:4711)")]
)
def test_a_missing_display_is_named(
    quads: Path, display: str, word: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("slangpy")
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["view", str(quads), "--screenshot", "a.png"]) == 2
    said = capfd.readouterr()
    assert said.err.startswith("lab: error: no window can be opened: ") and word in said.err
    assert "xvfb-run -a lab view" in said.err and "lab render SCENE --engine vulkan" in said.err
    assert said.err.count("\n") == 1 and said.out == "" and not list(Path().iterdir())


def test_the_help_tells_the_keys(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", "--help"]) == 0
    said = capsys.readouterr().out
    for key, what in KEYS:
        assert key in said and what in said
    for flag in ("--frames", "--screenshot", "--regenerate", "--camera", "--device", "--preset", "--size"):
        assert flag in said
