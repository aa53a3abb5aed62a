"""Times of stages are asked for once, and only by who looks at them."""

from __future__ import annotations

import time

import pytest

from lab.engine.clock import HostClock, StageTimes


def test_nobody_is_asked_before_somebody_looks() -> None:
    asked: list[int] = []

    def read() -> dict[str, float]:
        asked.append(1)
        return {"light": 2.0, "composite": 3.0}

    times = StageTimes(read)
    alone = times.only({"light"})
    assert not asked
    assert dict(alone) == {"light": 2.0, "composite": 0.0}
    assert dict(times) == {"light": 2.0, "composite": 3.0} and len(times) == 2 and times["light"] == 2.0
    assert asked == [1]
    assert "'light': 2.0" in repr(times)


def test_the_processor_s_clock() -> None:
    clock = HostClock()
    with clock.times("sleep"):
        time.sleep(0.02)
    with pytest.raises(RuntimeError), clock.times("broken"):
        raise RuntimeError
    assert list(clock.stages_ms) == ["sleep"]
    assert 20 <= clock.stages_ms["sleep"] < 2000
