"""Whose time a stage takes: an engine brings a clock for each frame."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol


class StageTimes(Mapping[str, float]):
    """Milliseconds by stage, asked of the clock when somebody first looks at one; until then nobody waits for it."""

    def __init__(self, read: Callable[[], Mapping[str, float]]) -> None:
        self._read: Callable[[], Mapping[str, float]] | None = read
        self._ms: dict[str, float] = {}

    def __getitem__(self, stage: str) -> float:
        return self._known()[stage]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known())

    def __len__(self) -> int:
        return len(self._known())

    def __repr__(self) -> str:
        return f"StageTimes({self._known()})"

    def only(self, stages: Collection[str]) -> StageTimes:
        """The same with 0 ms for all but `stages`."""
        return StageTimes(lambda: {stage: ms if stage in stages else 0.0 for stage, ms in self.items()})

    def _known(self) -> dict[str, float]:
        if self._read is not None:
            self._ms, self._read = dict(self._read()), None
        return self._ms


class StageClock(Protocol):
    """Takes the time of one frame's stages."""

    def times(self, stage: str) -> AbstractContextManager[None]:
        """The work handed out while this lasts is that of `stage`."""

    @property
    def stages_ms(self) -> StageTimes:
        """What every stage took, in the order in which they came."""


class HostClock:
    """Of an engine whose stages are done when their calls return: the time of these calls."""

    def __init__(self) -> None:
        self._ms: dict[str, float] = {}

    @contextmanager
    def times(self, stage: str) -> Iterator[None]:
        """See :class:`StageClock`."""
        start = time.perf_counter()
        yield
        self._ms[stage] = (time.perf_counter() - start) * 1e3

    @property
    def stages_ms(self) -> StageTimes:
        """See :class:`StageClock`."""
        return StageTimes(lambda: self._ms)
