"""``lab --help`` answers at once: it loads argparse and nothing of weight. Modules are counted: seconds flake."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

WEIGHTY = {"numpy", "rich", "open3d", "trimesh", "torch", "kornia", "pyvista", "OpenEXR", "PIL", "importlib.metadata"}

PROBE = """
import json, sys
before = set(sys.modules)
from lab.cli import main
code = main(sys.argv[1:])
print(json.dumps([code, sorted(set(sys.modules) - before)]))
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["render", "--help"],
        ["heatmap", "-h"],
        ["export", "-h"],
        ["bench", "-h"],
        ["render", "--sise"],
        ["info", "x"],
        [],
    ],
    ids=" ".join,
)
def test_help_and_usage_errors_load_nothing_heavy(arguments: list[str]) -> None:
    done = subprocess.run([sys.executable, "-c", PROBE, *arguments], capture_output=True, text=True, check=True)
    code, loaded = json.loads(done.stdout.splitlines()[-1])
    assert code == (0 if {"--help", "-h"} & set(arguments) else 2)
    assert not WEIGHTY & set(loaded)
    assert len(loaded) < 120


def test_import_lab_is_light() -> None:
    probe = "import sys; before = set(sys.modules); import lab; print(*sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert not WEIGHTY & set(done.stdout.split())
