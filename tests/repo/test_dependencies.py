"""Every dependency is declared and pinned, and the floors of the tools agree."""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import version
from itertools import chain
from pathlib import Path

import pytest

from .project import ROOT, imports, sources, text

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS: dict[str, list[str]] = PROJECT["project"]["optional-dependencies"]
DECLARED = [need for need in chain(PROJECT["project"]["dependencies"], *EXTRAS.values()) if "[" not in need]

# Import names that differ from the package's name.
PACKAGES = {"PIL": "pillow", "flip_evaluator": "flip-evaluator", "vtkmodules": "vtk", "trame_client": "trame-client"}


@pytest.mark.parametrize("need", DECLARED)
def test_every_dependency_is_pinned_and_installed_so(need: str) -> None:
    match = re.fullmatch(r"([\w.-]+)==([\w.]+)", need)
    assert match, f"{need}: pin it with =="
    # CPU or CUDA builds carry a local part, 2.15.0+cpu.
    assert version(match[1]).split("+")[0] == match[2]


def test_build_requirements_have_a_floor() -> None:
    for need in PROJECT["build-system"]["requires"]:
        assert re.fullmatch(r"[\w.-]+(==|>=)[\w.]+(,<[\w.]+)?", need), need


def test_the_extra_all_has_every_extra() -> None:
    assert EXTRAS["all"] == [f"many-lights-lab[{','.join(name for name in EXTRAS if name != 'all')}]"]


def test_no_dependency_twice() -> None:
    names = [need.split("==")[0].lower() for need in DECLARED]
    assert len(names) == len(set(names))


def test_everything_imported_is_declared() -> None:
    declared = {need.split("==")[0].lower() for need in DECLARED}
    own = {"lab", "gui", "tests", "scenes"}
    for path in [*sources(".py", under="lab"), *sources(".py", under="gui"), *sources(".py", under="tests")]:
        for name in {name.split(".")[0] for name in imports(path)} - own - set(sys.stdlib_module_names):
            local = (ROOT / path).parent / name
            if local.is_dir() or local.with_suffix(".py").is_file():
                continue
            assert PACKAGES.get(name, name).lower() in declared, f"{path} imports {name}, which pyproject.toml lacks"


def test_one_version() -> None:
    import lab

    assert lab.__version__ == PROJECT["project"]["version"] == version("many-lights-lab")


def test_one_python_floor() -> None:
    floor = PROJECT["project"]["requires-python"].removeprefix(">=")
    assert PROJECT["tool"]["ruff"]["target-version"] == f"py{floor.replace('.', '')}"
    assert PROJECT["tool"]["mypy"]["python_version"] == floor
    major, minor = floor.split(".")
    setup = (ROOT / ".house" / "setup.sh").read_text(encoding="utf-8")
    assert f"sys.version_info < ({major}, {minor})" in setup
    assert set(re.findall(r"version_info < \(([\d, ]+)\)", setup)) == {f"{major}, {minor}"}


def test_one_cmake_floor() -> None:
    need = next(need for need in PROJECT["build-system"]["requires"] if need.startswith("cmake"))
    floor = re.search(r">=([\d.]+)", need)
    stated = re.search(r"cmake_minimum_required\(VERSION ([\d.]+)", text(Path("core_cpp/CMakeLists.txt")))
    assert floor and stated and floor[1] == stated[1]
