"""The shape of the repository: what lies at the top, how long a file may be, and what must never be written in it."""

from __future__ import annotations

import os
import re
import statistics

import pytest

from .project import ROOT, files, sources, text

TOP = {"pyproject.toml", "lab", "core_cpp", "shaders", "gui", "tests", "scenes", "README.md", "Makefile", "LICENSE"}
CODE = (".py", ".cpp", ".h", ".slang", ".sh")


def test_nothing_else_lies_at_the_top() -> None:
    top = {path.parts[0] for path in files()}
    assert {name for name in top if not name.startswith(".")} <= TOP


@pytest.mark.parametrize("name", ["README.md", "LICENSE", "Makefile", "pyproject.toml", ".ci/run", ".clang-format"])
def test_what_must_be_there(name: str) -> None:
    assert (ROOT / name).is_file()


def test_scripts_can_be_run() -> None:
    for path in files():
        if text(path).startswith("#!"):
            assert os.access(ROOT / path, os.X_OK), f"{path} starts with #! and is not executable"


def test_files_stay_short() -> None:
    lengths = {path: len(text(path).splitlines()) for path in sources(*CODE)}
    assert {path: n for path, n in lengths.items() if n > 350} == {}, "split by idea"
    assert statistics.median(lengths.values()) <= 150


# Spelled in pieces, so that this file does not name what it forbids.
REGISTRIES = [
    "py" + r"pi\.org", "python" + r"hosted", r"conda\." + "anaconda", "npm" + r"js\.", "crates" + r"\.io",
    r"(deb|security|ftp|snapshot)[\w.]*\." + "debian" + r"\.", "archive" + r"\.ubuntu", "proxy" + r"\.golang",
    "maven" + r"\.org", "download" + r"\.pytorch",
]  # fmt: skip
PLACES = [rf"/{name}/" for name in ("work", "home/[a-z]+", "tmp", "root", "Users/[a-z]+")]


@pytest.mark.parametrize("pattern", REGISTRIES)
def test_no_registry_is_named(pattern: str) -> None:
    named = [str(path) for path in files() if re.search(pattern, text(path))]
    assert not named


@pytest.mark.parametrize("pattern", PLACES)
def test_no_path_of_a_machine(pattern: str) -> None:
    named = [str(path) for path in files() if re.search(rf"(?<![\w.]){pattern}", text(path))]
    assert not named, f"{pattern}: {named}"


def test_text_files_are_tidy() -> None:
    for path in files():
        content = text(path)
        if content and path.suffix not in {".obj", ".mtl", ".csv"}:
            assert content.endswith("\n") and not content.endswith("\n\n"), f"{path}: ends in exactly one line break"
            assert "\r" not in content, f"{path}: LF line ends"
            untidy = [i for i, line in enumerate(content.splitlines(), 1) if line != line.rstrip()]
            assert not untidy, f"{path}: spaces at the end of lines {untidy[:5]}"


def test_nothing_is_left_unfinished() -> None:
    marks = re.compile("|".join(rf"\b{mark}\b" for mark in ("TO" + "DO", "FIX" + "ME", "XX" + "X", "HA" + "CK")))
    assert [str(path) for path in sources(*CODE) if marks.search(text(path))] == []


def test_committed_files_are_small() -> None:
    sizes = {path: (ROOT / path).stat().st_size for path in files()}
    assert {path: size for path, size in sizes.items() if size > 8 * 2**20} == {}
    assert sum(sizes.values()) < 24 * 2**20
