"""The stages of a frame over one setting: its values take turns."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

from lab.bench.definitions import SWEEPS
from lab.bench.measure import View
from lab.bench.turns import Turn, take_turns
from lab.engine.engine import STAGES
from lab.errors import LabError, nearest

Record = dict[str, Any]

VALUES: dict[str, tuple[int, ...]] = {
    "vpls": (1_000, 10_000, 100_000, 1_000_000),
    "interleave": (1, 2, 4, 8),
    "shadow_samples": (0, 1, 2, 4, 8, 16),
}


def check_sweeps(names: Sequence[str], engine: str = "cpu") -> None:
    """Raises :class:`LabError` for a sweep that is not, or not of `engine`."""
    for name in names:
        if name not in SWEEPS:
            raise LabError(f"--sweep {name}: there are {', '.join(SWEEPS)}{nearest(name, SWEEPS)}")
        if name == "threads" and engine != "cpu":
            raise LabError(f"--sweep threads: engine {engine} computes on a device, which has its own; leave it out")


def thread_counts(most: int) -> tuple[int, ...]:
    """1, 2, 4 ... and `most` itself."""
    return tuple(sorted({most, *(2**i for i in range(most.bit_length()) if 2**i <= most)}))


def sweep(view: View, name: str, rounds: int, tell: Callable[[float, str], None]) -> Record:
    """Whole frames at every value of `name`; ``threads`` goes up to the processor's."""
    values = thread_counts(os.cpu_count() or 1) if name == "threads" else VALUES[name]

    def frame(value: int) -> Callable[[], dict[str, float]]:
        if name != "threads":
            return lambda: view.time_frame(**{name: value})

        def take() -> dict[str, float]:
            before = view.renderer.threads
            view.renderer.threads = value
            try:
                return view.time_frame()
            finally:
                view.renderer.threads = before

        return take

    found = take_turns({str(value): Turn(frame(value)) for value in values}, rounds, tell)
    return {
        "values": list(values),
        "stages_ms": [{stage: found[str(value)][stage] for stage in STAGES} for value in values],
        "frame_ms": [found[str(value)]["frame"] for value in values],
    }
