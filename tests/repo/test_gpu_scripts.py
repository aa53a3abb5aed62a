"""The scripts for a machine with a graphics card: what can be told without one, a network or minutes of time."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

from .project import ROOT, text

PACK, MACHINE = Path(".house/pack_gpu.sh"), Path(".house/gpu_machine.sh")


def run(script: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["bash", str(ROOT / script), *arguments], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("script", [PACK, MACHINE], ids=str)
def test_they_are_shell_and_say_what_they_want(script: Path) -> None:
    assert subprocess.run(["bash", "-n", str(ROOT / script)], check=False).returncode == 0
    done = run(script)
    assert done.returncode == 2 and "error: name" in done.stderr and script.name in done.stderr


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    done = run(MACHINE, str(tmp_path), str(tmp_path / "results"))
    assert done.returncode == 2 and "holds no slangpy.tar.xz" in done.stderr
    assert not (tmp_path / "results").exists()


def test_a_scene_that_is_not_there_is_refused(tmp_path: Path) -> None:
    done = run(PACK, str(tmp_path / "carried"), str(tmp_path / "nothing.glb"))
    assert done.returncode == 2 and "there is no scene" in done.stderr
    (tmp_path / "slangpy.tar.xz").touch()
    done = run(MACHINE, str(tmp_path), str(tmp_path / "results"), str(tmp_path / "nothing.glb"))
    assert done.returncode == 2 and "there is no scene" in done.stderr


def test_what_stays_here_is_needed_by_no_import() -> None:
    """Every dependency is carried, or the machine has it, or it is one of the few that are left out by name."""
    script = text(PACK)
    there = re.search(r"MACHINE_HAS:-([^}]*)}", script)
    left_out = re.search(r'left = \{"([\w-]+)"', script)
    assert there and left_out
    project = tomllib.loads(text(Path("pyproject.toml")))["project"]
    names = {re.split(r"[^\w.-]", need)[0].lower() for need in project["dependencies"]}
    assert left_out[1] in names and "numpy" in there[1].split()
    imported = re.compile(rf"^(import|from) {left_out[1]}", re.MULTILINE)
    assert not [path for path in (ROOT / "lab").rglob("*.py") if imported.search(path.read_text())]


def test_the_modules_that_it_runs_are_there() -> None:
    named = set(re.findall(r"-m (lab\.experiments\.\w+)", text(MACHINE)))
    assert "lab.experiments.paper_tables" in named
    for module in named - {"lab.experiments.race_laboratory"}:
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").is_file(), module
