"""Files are whole or not there at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from lab.errors import LabError
from lab.outputs import base_path, beside, check_writable, write_all


@pytest.mark.parametrize(
    ("text", "base"),
    [("out/a", "out/a"), ("out/a.png", "out/a"), ("a.EXR", "a"), ("out/night.v2", "out/night.v2"), ("a.json", "a")],
)
def test_base_path_cuts_only_our_endings(text: str, base: str) -> None:
    assert base_path(text) == Path(base)
    assert beside(Path("night.v2"), ".png") == Path("night.v2.png")


@pytest.mark.parametrize("text", ["", "somewhere/", ".", "/"])
def test_a_folder_is_no_base(text: str) -> None:
    with pytest.raises(LabError, match="folder"):
        base_path(text)


def test_check_leaves_no_trace(tmp_path: Path) -> None:
    check_writable(tmp_path / "a" / "b" / "c.png")
    assert not list(tmp_path.iterdir())


def test_check_refuses_what_would_fail_later(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "taken.png").mkdir()
    for path in (
        tmp_path / "file" / "a.png",
        tmp_path / "taken.png",
        Path("/proc/a/b.png"),
        tmp_path / ("x" * 300),
    ):
        with pytest.raises(LabError, match="can't be written"):
            check_writable(path)


def test_nothing_changes_unless_all_are_written(tmp_path: Path) -> None:
    first, second = tmp_path / "a.png", tmp_path / "b.json"
    first.write_text("old")

    def fail(path: Path) -> None:
        path.write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_all({first: lambda path: path.write_text("new") and None, second: fail})
    assert first.read_text() == "old"
    assert list(tmp_path.iterdir()) == [first]


def test_all_are_written_with_their_folders(tmp_path: Path) -> None:
    paths = [tmp_path / "deep" / "er" / name for name in ("a", "b")]
    write_all({path: lambda target: target.write_text("x") and None for path in paths})
    assert sorted((tmp_path / "deep" / "er").iterdir()) == paths
