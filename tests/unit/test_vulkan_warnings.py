"""What Slang warns of is an error."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from lab.engine.vulkan.program import SHADERS, ComputeProgram
from lab.engine.vulkan.reflection import ShaderError

CLEAN = """
[shader("compute")] [numthreads(1, 1, 1)]
void run(uniform RWStructuredBuffer<int> rows, uniform int64_t large) { rows[0] = int(large); }
"""


@pytest.mark.parametrize(
    ("clean", "doubtful", "said"),
    [
        ("int(large)", "large", "implicit conversion"),
        ("rows[0]", "for (int i = 0; i < 0; ++i) rows[i]", "loop"),
    ],
)
def test_a_warning_is_an_error(gpu: Any, tmp_path: Path, clean: str, doubtful: str, said: str) -> None:
    (tmp_path / "clean.slang").write_text(CLEAN)
    assert ComputeProgram(gpu.device, str(tmp_path / "clean"), "run", {}).names == ["rows", "large"]
    (tmp_path / "doubtful.slang").write_text(CLEAN.replace(clean, doubtful))
    with pytest.raises(ShaderError, match=f"does not compile:(.|\n)*{said}"):
        ComputeProgram(gpu.device, str(tmp_path / "doubtful"), "run", {})


@pytest.mark.parametrize("name", sorted(path.stem for path in (SHADERS / "passes").glob("*.slang")))
def test_every_pass_is_without_warnings(gpu: Any, name: str) -> None:
    assert gpu.device.load_module(f"passes/{name}").entry_points
