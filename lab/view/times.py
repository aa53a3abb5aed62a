"""How long frames take: smoothed for the panel, and the medians of a run."""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection, Mapping

from lab.engine.engine import STAGES

_MEMORY_MS = 400.0  # what is shown is the mean over about so long, or the last frame where that took longer
_LEAST_MS = 100.0  # between two measurements of the stages


class Times:
    """Milliseconds of frames and of their stages on the device.

    Attributes:
        frame_ms: from one frame to the next, smoothed.    stages_ms: of each stage, smoothed.

    """

    def __init__(self) -> None:
        self.frame_ms = 0.0
        self.stages_ms: dict[str, float] = {}
        self._frames: list[float] = []
        self._stages: dict[str, list[float]] = {}
        self._done: set[str] = set()

    def add_frame(self, ms: float) -> None:
        """A frame was shown, so long after the one before."""
        self.frame_ms = _smoothed(self.frame_ms, ms, ms)
        self._frames.append(ms)

    def add_stages(self, stages_ms: Mapping[str, float], done: Collection[str]) -> None:
        """What the device took for the stages of a frame; `done`: those that were not kept from before."""
        for stage in done:
            ms, before = stages_ms[stage], self.stages_ms.get(stage, 0.0)
            self.stages_ms[stage] = _smoothed(before, ms, max(self.frame_ms, _LEAST_MS))
            self._stages.setdefault(stage, []).append(ms)
        self._done = set(done)

    def medians(self) -> dict[str, float]:
        """Of each stage that was measured, in a frame's order, and of whole frames as ``frame``."""
        known = sorted(self._stages, key=_place)
        found = {stage: statistics.median(self._stages[stage]) for stage in known}
        return found | ({"frame": statistics.median(self._frames)} if self._frames else {})

    def lines(self) -> tuple[str, ...]:
        """For the panel."""
        if not self.frame_ms:
            return ()
        shown = sorted(self.stages_ms, key=_place)
        device = sum(ms for stage, ms in self.stages_ms.items() if stage in self._done)
        return (
            f"{1e3 / self.frame_ms:.1f} frames a second, {_ms(self.frame_ms)} each; of that the device:",
            *(f"{_ms(self.stages_ms[stage])}   {stage}{'' if stage in self._done else '  (kept)'}" for stage in shown),
            f"{_ms(device)}   together",
        )


def _ms(value: float) -> str:
    """Four digits or so."""
    decimals = 3 if value < 10 else 2 if value < 100 else 1 if value < 1000 else 0
    return f"{value:,.{decimals}f} ms"


def _smoothed(before: float, now: float, after_ms: float) -> float:
    """`now`, measured so long after what made `before`."""
    return now if before == 0 else before + (1 - math.exp(-after_ms / _MEMORY_MS)) * (now - before)


def _place(stage: str) -> int:
    return STAGES.index(stage) if stage in STAGES else len(STAGES)
