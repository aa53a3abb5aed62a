"""Bad input writes nothing and says why in one line; a failure leaves the old files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.cli import main

from .command_line import SMALL, files, refused

pytestmark = pytest.mark.usefixtures("empty_folder")

BAD_FLAGS = {
    "an unknown setting": (["--set", "alhpa=2"], "alpha"),
    "alpha zero": (["--set", "alpha=0"], "alpha=0"),
    "alpha not a number": (["--set", "alpha=nan"], "alpha=nan"),
    "alpha negative": (["--set", "alpha=-1"], "alpha=-1"),
    "no vpls": (["--set", "vpls=0"], "vpls=0"),
    "vpls negative": (["--set", "vpls=-1"], "vpls=-1"),
    "vpls a word": (["--set", "vpls=abc"], "vpls=abc"),
    "interleave": (["--set", "interleave=3"], "1 | 2 | 4 | 8"),
    "shadow samples": (["--set", "shadow_samples=-1"], "shadow_samples=-1"),
    "clamp distance": (["--set", "clamp_distance=-1"], "clamp_distance=-1"),
    "levels": (["--set", "levels=99"], "auto"),
    "filter": (["--set", "filter=magic"], "atrous"),
    "no value": (["--set", "alpha"], "name=value"),
    "an unknown preset": (["--preset", "papier"], "'paper'"),
    "size zero": (["--size", "0x10"], "0x10"),
    "size of words": (["--size", "axb"], "1280x720"),
    "size of one number": (["--size", "640"], "640"),
    "size too large": (["--size", "16384x16384"], "megapixels"),
    "size absurd": (["--size", "9" * 5000 + "x1"], "--size"),
    "threads": (["--threads", "0"], "--threads 0"),
    "threads a word": (["--threads", "many"], "--threads many"),
    "seed": (["--seed", "-1"], "seed=-1"),
    "engine": (["--engine", "gpu"], "cpu"),
    "exposure": (["--exposure", "0"], "--exposure"),
    "exposure not finite": (["--exposure", "inf"], "--exposure"),
    "camera": (["--camera", "frnt"], "front"),
    "camera numbers": (["--camera", "1,2:3,4"], "camera"),
    "sun": (["--sun", "0,0,0"], "sun"),
    "sun words": (["--sun", "up"], "sun"),
    "an unknown flag": (["--sice", "1x1"], "--sice"),
}


@pytest.mark.parametrize("name", BAD_FLAGS)
def test_bad_flags_are_refused(quads: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    flags, hint = BAD_FLAGS[name]
    assert hint in refused(["render", str(quads), "-o", "new/a", *flags], capsys)
    assert not Path("new").exists()


@pytest.mark.parametrize("command", ["render", "heatmap", "export"])
def test_every_command_refuses_alike(quads: Path, command: str, capsys: pytest.CaptureFixture[str]) -> None:
    output = ["-o", "a.npz" if command == "export" else "a"]
    assert "alpha" in refused([command, str(quads), *output, "--set", "alpha=0"], capsys)
    assert "missing.glb" in refused([command, "missing.glb", *output], capsys)
    assert "no scene given" in refused([command, *output], capsys)


def test_outputs_that_cannot_be_written(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("file").write_text("mine")
    Path("taken.exr").mkdir()
    for output in ("file/a", "taken", "/proc/nowhere/a", ".", "x" * 300):
        assert "-o" in refused(["render", str(quads), "-o", output, *SMALL], capsys)
        assert "-o" in refused(["heatmap", str(quads), "-o", output, *SMALL], capsys)
    for output in ("file/a.npz", "a.obj", ".", "/proc/nowhere/a.npz"):
        assert "-o" in refused(["export", str(quads), "-o", output, "--set", "vpls=9"], capsys)
    assert Path("file").read_text() == "mine"


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", '{"params": {}}', '{"scene": {}, "params": 3}', "\udcff", "[" * 100_000,
     '{"scene": {}, "params": {}}', '{"scene": {"path": "gone.glb"}, "params": {"alpha": 0}}',
     '{"scene": {"path": "gone.glb"}, "params": {"alhpa": 1}}', '{"scene": {"path": "gone.glb"}, "params": {}}',
     '{"scene": {"path": "gone.glb", "size": [1, 2, 3]}, "params": {}}',
     '{"scene": {"path": "gone.glb", "size": 7}, "params": {}}', '{"scene": {"path": 3}, "params": {}}',
     '{"scene": {"path": "gone.glb", "overrides": {"sun": 3}}, "params": {}}',
     '{"scene": {"path": "gone.glb", "overrides": [1]}, "params": {}}',
     '{"preset": 5, "scene": {"path": "gone.glb"}, "params": {}}',
     '{"engine": [], "scene": {"path": "gone.glb"}, "params": {}}'],
    ids=range(19),
)  # fmt: skip
def test_broken_records_are_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("r.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    refused(["render", "--from", "r.json", "-o", "a"], capsys)


def test_missing_records_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("folder.json").mkdir()
    for name in ("missing.json", "folder.json"):
        assert name in refused(["render", "--from", name, "-o", "a"], capsys)


def test_no_command_and_unknown_commands_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    refused([], capsys)
    refused(["rendr"], capsys)


# --- failures that are not the user's -----------------------------------------------------------


def broken(error: BaseException) -> Callable[..., None]:
    def render(*_: object, **__: object) -> None:
        raise error

    return render


def test_an_unexpected_failure_is_one_line(
    quads: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("lab.commands.render.render", broken(RuntimeError("the roof\nfell in")))
    assert main(["render", str(quads), "-o", "a", *SMALL]) == 1
    said = capsys.readouterr().err
    assert said == "lab: failed: RuntimeError: the roof fell in (--debug shows where)\n"
    monkeypatch.setattr("lab.commands.render.render", broken(MemoryError()))
    assert main(["render", str(quads), "-o", "a", *SMALL]) == 1
    assert "out of memory" in capsys.readouterr().err
    monkeypatch.setattr("lab.commands.render.render", broken(KeyboardInterrupt()))
    assert main(["render", str(quads), "-o", "a", *SMALL]) == 130
    assert files() == []


def test_debug_shows_the_traceback(quads: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.commands.render.render", broken(RuntimeError("the roof")))
    for arguments in (["--debug", "render", str(quads)], ["render", str(quads), "--debug"]):
        with pytest.raises(RuntimeError, match="the roof"):
            main([*arguments, "-o", "a", *SMALL])


def test_a_write_that_fails_leaves_the_old_files(quads: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["render", str(quads), "-o", "a", *SMALL, "--quiet"]) == 0
    before = {name: Path(name).read_bytes() for name in files()}

    def full(path: Path, *_: object) -> None:
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("lab.image_io.write_exr", full)
    assert main(["render", str(quads), "-o", "a", *SMALL, "--seed", "5"]) == 1
    assert {name: Path(name).read_bytes() for name in files()} == before
