"""ruff, mypy and clang-format have nothing to say."""

from __future__ import annotations

import shutil
import subprocess
import sysconfig

import pytest

from .project import ROOT, sources


def check(*command: str) -> None:
    """Runs a tool of this environment at the top of the repository; its words are the failure's message."""
    tool = shutil.which(command[0], path=sysconfig.get_path("scripts"))
    assert tool, f"{command[0]} is not installed; run 'make test'"
    done = subprocess.run([tool, *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.fail(f"{' '.join(command[:3])}\n{done.stdout[-6000:]}{done.stderr[-3000:]}", pytrace=False)


def test_ruff_check() -> None:
    check("ruff", "check", ".")


def test_ruff_format() -> None:
    check("ruff", "format", "--check", ".")


def test_mypy() -> None:
    check("mypy")


def test_clang_format() -> None:
    check("clang-format", "--dry-run", "-Werror", *map(str, sources(".cpp", ".h", under="core_cpp")))


@pytest.mark.parametrize(
    "script", [".house/setup.sh", ".house/software_vulkan.sh", ".house/validate_vulkan.sh", ".ci/run"]
)
def test_shell_scripts_parse(script: str) -> None:
    done = subprocess.run(["bash", "-n", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
