"""``lab bench --engine vulkan``: the same record by the device's clock, without what has no meaning there."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lab.bench import measure, sweep
from lab.bench.compare import compare
from lab.bench.definitions import HELP, RATIOS, ratios_of
from lab.bench.limits import machine_of
from lab.bench.measure import Effort
from lab.cli import main
from lab.commands import bench as command
from lab.engine import STAGES

from ..conftest import write_quads
from .command_line import files, refused

FEW, SOME, MANY = 60, 200, 500
FLAGS = ["--size", "40x32", "--set", "vpls=200", "direct_samples=1", "--engine", "vulkan"]


@pytest.fixture(scope="module")
def run(gpu: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """One benchmark's folder, its record, and what was printed."""
    folder = tmp_path_factory.mktemp("bench")
    scene = write_quads(folder / "quads")
    with pytest.MonkeyPatch.context() as patch:
        little = partial(Effort, few=FEW, many=MANY, scattered=SOME)
        little.in_software = little  # type: ignore[attr-defined]
        patch.setattr(measure, "Effort", little)
        patch.setattr("lab.bench.limits.STREAM_BYTES", 2**20)
        patch.setitem(sweep.VALUES, "interleave", (1, 2))
        out = folder / "b"
        assert main(["bench", str(scene), "-o", str(out), *FLAGS, "--frames", "2", "--sweep", "interleave"]) == 0
    return scene, out.with_suffix(".json"), json.loads(out.with_suffix(".json").read_text())


def test_the_record_is_the_device_s(gpu: Any, run: Any) -> None:
    record = run[2]
    assert record["engine"] == "vulkan" and record["device"] == gpu.describe() and record["date"][:2] == "20"
    assert set(record["ratios"]) == set(ratios_of("vulkan")) and "gbuffer_vs_embree" not in record["ratios"]
    assert all(value > 0 for value in record["ratios"].values())
    assert list(record["stages_ms"]) == list(record["limits"]["stages_ms"]) == list(STAGES)
    assert all(record["stages_ms"][stage]["median"] > 0 for stage in STAGES)
    assert all(record["limits"]["stages_ms"][stage]["median"] > 0 for stage in STAGES)
    assert record["limits"]["own_light_kernel_ms"] is None
    assert record["counts"]["rays"]["render_gbuffer"] == 40 * 32
    assert 0 < record["counts"]["pairs_used"] <= record["counts"]["pairs_visited"]
    assert record["construction_ms"]["many"]["lights"] == record["growth"]["many"]["lights"] == MANY
    assert list(record["sweeps"]) == ["interleave"] and record["sweeps"]["interleave"]["values"] == [1, 2]
    assert any("is no card" in note for note in record["notes"]) == gpu.software


def test_the_host_s_time_stands_beside_the_device_s(run: Any) -> None:
    record = run[2]
    frames = [record, record["fast_frame"], *record["regenerated"]["frames"].values()]
    assert len(frames) == 6
    for frame in frames:
        assert 0 < frame["host_ms"]["median"] <= frame["wall_ms"]["median"]
    total = sum(record["stages_ms"][stage]["median"] for stage in STAGES)
    assert record["frame_ms"]["median"] == pytest.approx(total, rel=0.5)


def test_records_of_one_device_are_compared(gpu: Any, run: Any, empty_folder: Path, capsys: Any) -> None:
    scene, before, record = run
    other = json.loads(json.dumps(record))

    def about_devices() -> list[str]:
        return [warning for warning in compare(record, other).warnings if "device" in warning]

    assert about_devices() == []
    other["device"]["driver"] = "of yesterday"
    assert len(about_devices()) == 1 and "driver was of yesterday, is" in about_devices()[0]
    flags = ["bench", str(scene), *FLAGS[:-2], "--compare", str(before)]
    assert "engine vulkan there, cpu here" in refused(flags, capsys)


def test_threads_are_no_sweep_of_a_device(quads: Path, empty_folder: Path, capsys: Any) -> None:
    said = refused(["bench", str(quads), *FLAGS, "--sweep", "threads"], capsys)
    assert "--sweep threads" in said and files() == []


@pytest.mark.parametrize(("software", "quick", "frames"), [(False, False, 256), (False, True, 64), (True, True, 2)])
def test_a_card_is_given_more_frames(monkeypatch: pytest.MonkeyPatch, software: bool, quick: bool, frames: int) -> None:
    monkeypatch.setattr("lab.engine.vulkan.device.open_gpu", lambda _: SimpleNamespace(software=software))
    request: Any = SimpleNamespace(engine="vulkan", device="")
    effort = command._effort(SimpleNamespace(quick=quick, frames=None), request)  # type: ignore[arg-type]
    assert effort.frames == frames and effort.many == (100_000 if software else 1_000_000)


def test_help_tells_what_has_no_meaning() -> None:
    for name, definition in RATIOS.items():
        assert (f"{name} (cpu)" in HELP) == (definition.engines == ("cpu",))


def test_an_unknown_engine_has_no_limits() -> None:
    with pytest.raises(TypeError, match="SimpleNamespace"):
        machine_of(SimpleNamespace())  # type: ignore[arg-type]
