"""A stage has one name everywhere."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

from lab.engine.engine import STAGES, Engine

from .project import ROOT, files, text


def test_engine_has_one_method_a_stage_and_a_clock() -> None:
    methods = [name for name, _ in inspect.getmembers(Engine, inspect.isfunction) if not name.startswith("_")]
    assert sorted(methods) == sorted([*STAGES, "clock"])


def test_a_frame_calls_the_stages_in_order() -> None:
    calls = re.findall(r"timed\(engine\.(\w+)", text(Path("lab/frame.py")))
    assert tuple(calls) == STAGES


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("pattern", ["core_cpp/include/lab/{}.h", "core_cpp/src/{}.cpp", "tests/unit/test_{}.py"])
def test_a_stage_has_its_files(stage: str, pattern: str) -> None:
    assert (ROOT / pattern.format(stage)).is_file(), f"{pattern.format(stage)} is missing"


@pytest.mark.parametrize("stage", STAGES)
def test_the_core_offers_each_stage_by_name(stage: str) -> None:
    from lab import _core

    bindings = "".join(text(path) for path in files() if path.is_relative_to("core_cpp/bind"))
    assert f'"{stage}"' in bindings, f"no binding is called {stage}"
    assert stage in dir(_core) or any(stage in dir(value) for value in vars(_core).values())
