"""The cache of compiled shaders: whatever happens to it, nothing crashes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from lab.engine.vulkan.device import Gpu
from lab.engine.vulkan.shader_cache import cache_folder, cache_options, is_cut_short
from lab.errors import LabError

COMPILE = """
from lab.engine.vulkan.device import Gpu
gpu = Gpu()
print(gpu.program("composite", "take_ratios", {"channels": 1}).names[0])
gpu.close()
"""


@pytest.fixture
def folder(gpu: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own."""
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "cache"))
    return cache_folder()


@contextmanager
def opened() -> Iterator[Gpu]:
    gpu = Gpu(os.environ.get("LAB_TEST_DEVICE", ""))
    yield gpu
    gpu.close()


def compile_one() -> None:
    with opened() as gpu:
        assert gpu.program("composite", "take_ratios", {"channels": 1}).names


def in_another_process() -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-c", COMPILE], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_processes_share_an_empty_cache(folder: Path) -> None:
    for process in [in_another_process() for _ in range(2)]:
        assert process.communicate(timeout=60) == ("position_depth\n", "") and process.returncode == 0
    assert list(folder.rglob("composite.slang-module"))


def test_a_cache_that_was_cut_short_starts_afresh(folder: Path) -> None:
    compile_one()
    (data,) = folder.rglob("data.mdb")
    assert not is_cut_short(data)
    for file in [data, *folder.rglob("*.slang-module")]:
        os.truncate(file, file.stat().st_size // 2)
    assert is_cut_short(data)
    process = in_another_process()
    assert process.communicate(timeout=60) == ("position_depth\n", "") and process.returncode == 0
    assert not is_cut_short(data)


def test_damaged_modules_are_told_and_thrown_away(folder: Path) -> None:
    compile_one()
    for file in folder.rglob("*.slang-module"):
        content = bytearray(file.read_bytes())
        middle = len(content) // 2
        content[middle : middle + 16] = b"garbage, garbage"
        file.write_bytes(content)
    with pytest.raises(LabError, match=r"what was compiled before is damaged.*was deleted: try again"):
        compile_one()
    compile_one()


def test_where_nothing_can_be_written_there_is_no_cache(folder: Path) -> None:
    assert set(cache_options()) == {"shader_cache_path", "module_cache_path"}
    folder.rmdir()
    folder.write_text("in the way")
    assert cache_options() == {}
    compile_one()
