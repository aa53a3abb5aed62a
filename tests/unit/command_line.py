"""Running the command line in a test's own folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from lab.cli import main

SMALL = ["--size", "32x18", "--set", "vpls=200", "direct_samples=1"]


def files(folder: Path = Path()) -> list[str]:
    """Every file under `folder`, relative to it."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Runs a command that must be refused: exit code 2, one line, no traceback; returns the line."""
    before = files()
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert not said.out
    assert said.err.startswith("lab: error: ") and said.err.count("\n") == 1, said.err
    assert files() == before, "bad input touches no file"
    assert not list(Path().rglob("*.tmp"))
    return said.err
