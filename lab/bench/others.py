"""How much of the processor others had meanwhile: what a time is worth depends on it."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

QUIET = 0.05
"""Of the processors, for others: up to here nobody needs to be told."""

_STAT = Path("/proc/stat")
_IDLE = slice(3, 5)
"""Columns of the system's line that no program used: idle and waiting for a disk."""
_COUNTED = 8
"""The first columns: user, nice, system, idle, iowait, irq, softirq, steal. The rest is in them already."""


@dataclass(frozen=True)
class Moment:
    """Seconds since some start: of the clock, of all processors together, and of this process."""

    clock: float
    busy: float
    own: float


def now() -> Moment | None:
    """The moment of the call; None where the system does not tell."""
    try:
        line = _STAT.read_text(encoding="ascii").split("\n", 1)[0].split()
        ticks = [int(word) for word in line[1 : 1 + _COUNTED]]
        busy = (sum(ticks) - sum(ticks[_IDLE])) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return None
    own = os.times()
    return Moment(time.perf_counter(), busy, own.user + own.system)


def share_of_others(start: Moment | None, end: Moment | None) -> float | None:
    """The part of all processors' time, 0 to 1, that others had from `start` to `end`."""
    if start is None or end is None or end.clock <= start.clock:
        return None
    taken = (end.busy - start.busy) - (end.own - start.own)
    return min(1.0, max(0.0, taken / ((end.clock - start.clock) * (os.cpu_count() or 1))))
