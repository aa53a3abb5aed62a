"""What a user could lose: the scene's own files, and the wish to stop."""

from __future__ import annotations

import json
import shutil
import signal
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from lab import interrupts
from lab.cli import main
from lab.errors import LabError
from lab.outputs import check_no_input

from .command_line import SMALL, refused


@pytest.fixture
def bare(quads: Path) -> Path:
    """The tiny scene's mesh with a JSON beside it, as bare files are described."""
    mesh = quads.parent / "quads.obj"
    sidecar = {"sun_direction_to_sun": [0, 1, 0], "name": "kept"}
    mesh.with_suffix(".json").write_text(json.dumps(sidecar))
    return mesh


def test_a_picture_never_replaces_what_describes_the_scene(bare: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = bare.with_suffix(".json").read_bytes()
    line = refused(["render", str(bare), "-o", str(bare.with_suffix("")), *SMALL], capsys)
    assert "quads.json is a file that the scene is read from" in line
    assert bare.with_suffix(".json").read_bytes() == before


def test_the_record_of_a_run_is_no_description(bare: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a description of its own a scene's record may stand beside it, and be replaced by the next one."""
    bare.with_suffix(".json").unlink()
    for _ in range(2):
        assert main(["render", str(bare), "-o", str(bare.with_suffix("")), *SMALL]) == 0
        assert "left alone" not in capsys.readouterr().out
    assert "stages_ms" in json.loads(bare.with_suffix(".json").read_text())


def test_an_export_never_replaces_the_light_list(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(root / "scenes" / "lamps", tmp_path / "lamps")
    lights = tmp_path / "lamps" / "lamps.npz"
    before = lights.read_bytes()
    assert "lamps.npz is a file that" in refused(
        ["export", str(tmp_path / "lamps" / "scene.toml"), "-o", str(lights)], capsys
    )
    assert lights.read_bytes() == before


def test_links_are_seen_through(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("a")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    check_no_input([tmp_path / "c"], [tmp_path / "a"])
    with pytest.raises(LabError, match="choose another name"):
        check_no_input([tmp_path / "b"], [tmp_path / "a"])


def test_a_swallowed_interrupt_stops_the_run_all_the_same() -> None:
    before = signal.getsignal(signal.SIGINT)
    with interrupts.remembered():
        interrupts.check()
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException as error:
            assert isinstance(error, KeyboardInterrupt)  # as a careless library would: caught, and forgotten
        assert interrupts.pressed()
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
    assert signal.getsignal(signal.SIGINT) is before
    with interrupts.remembered():
        assert not interrupts.pressed(), "each run starts anew"


def test_other_threads_leave_what_was_pressed_as_it_is() -> None:
    """A worker can set no handler, and must not make the main thread's run forget; its own work ends with that run."""
    seen: list[object] = []

    def work() -> None:
        with interrupts.remembered():
            seen.append(interrupts.pressed())
            try:
                interrupts.check()
            except KeyboardInterrupt:
                seen.append("ended")

    with interrupts.remembered():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        worker = threading.Thread(target=work)
        worker.start()
        worker.join()
        assert interrupts.pressed()
    assert seen == [True, "ended"]
    with interrupts.remembered():
        interrupts.check()
