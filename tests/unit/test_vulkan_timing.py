"""A frame's times are those of the device, for that very frame."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

import lab
from lab.cli import main
from lab.engine import STAGES
from lab.engine.vulkan import timing
from lab.engine.vulkan.driver import driver_of
from lab.engine.vulkan.timing import Clock, DeviceClock
from lab.params import Params

from .command_line import SMALL
from .vulkan_scenes import engines

LITTLE = Params(vpls=300, shadow_samples=1, direct_samples=1)


def clear_some(gpu: Any, name: str = "clear") -> None:
    with gpu.stage(name) as encoder:
        encoder.clear_buffer(gpu.pool.take(4096, "4f4", "cleared").raw)


def frame(gpu: Any, size: tuple[int, int], **changes: object) -> lab.Frame:
    engine = engines(gpu, "cornell")[0]
    return lab.render(engine.scene, LITTLE.replace(**changes), size=size, engine=engine, counts=False)


def test_a_frame_has_its_own_times(gpu: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    real = Clock.read

    def read(clock: Clock, place: Any, submission: int) -> float:
        asked.append(submission)
        return real(clock, place, submission)

    monkeypatch.setattr(timing.Clock, "read", read)
    _, large, small = frame(gpu, (8, 8)), frame(gpu, (96, 64)), frame(gpu, (4, 4))  # drivers compile in the first
    assert not asked, "a frame waits for no time"
    assert tuple(large.stages_ms) == tuple(small.stages_ms) == STAGES
    assert all(ms > 0 for ms in large.stages_ms.values())
    assert large.stages_ms["light"] > 2 * small.stages_ms["light"]
    assert large.total_ms == sum(large.stages_ms.values())
    assert len(asked) == len(set(asked)) >= 2 * len(STAGES), "each span is read once"


def test_all_of_a_stage_s_work_is_added_up(gpu: Any) -> None:
    clock, spans = DeviceClock(gpu), []
    with clock.times("several"):
        for _ in range(3):
            clear_some(gpu)
            spans.append(gpu.spans["clear"])
    clear_some(gpu)  # of no stage
    with clock.times("host"):
        time.sleep(0.02)
    assert clock.stages_ms["several"] == sum(span.ms for span in spans) > 0
    assert 20 <= clock.stages_ms["host"] < 2000, "where the device had nothing to do, the host's time counts"


def test_spans_are_held_as_long_as_somebody_wants(gpu: Any) -> None:
    held = []
    for _ in range(timing._SPANS + 5):
        clear_some(gpu)
        held.append(gpu.spans["clear"])
    assert all(0 < span.ms < 1e4 for span in held)
    assert len({span._place for span in held}) == len(held)


def test_a_place_rests_while_the_device_may_write_there(gpu: Any) -> None:
    clock = Clock(gpu.device)
    encoder = gpu.device.create_command_encoder()
    first = clock.begin(encoder)
    clock.end(encoder, first)
    place = first._place
    with pytest.raises(RuntimeError, match="never handed"):
        _ = first.ms
    first.submission = gpu.device.submit_command_buffer(encoder.finish())
    gpu.device.wait()
    unfinished = type("Busy", (), {"is_submit_finished": lambda *_: False})()
    clock._device, device = unfinished, clock._device
    del first
    clock._free.clear()
    clock._free.append(("other", 0))
    assert clock._take() == ("other", 0)
    clock._device = device
    assert clock._take() == place


def test_the_driver_is_named(gpu: Any) -> None:
    about = gpu.describe()
    assert about["kind"] in ("integrated", "discrete", "virtual", "software") and about["driver"]
    assert gpu.software == ("llvmpipe" in gpu.adapter.name)
    assert driver_of("no such card", (0,) * 16) is None


def test_the_summary_says_whose_clock_it_is(
    gpu: Any, quads: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", str(quads), "-o", str(tmp_path / "a"), *SMALL, "--engine", "vulkan"]) == 0
    assert f"by the clock of {gpu.adapter.name}" in capsys.readouterr().out
    assert main(["render", str(quads), "-o", str(tmp_path / "b"), *SMALL]) == 0
    assert "by the clock" not in capsys.readouterr().out
