"""How long the device takes for spans of work, by timestamps that it writes itself."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lab.engine.clock import StageTimes
from lab.engine.vulkan.adapters import import_slangpy

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu

_SPANS = 256
"""Places for spans that are made at once."""

Place = tuple[Any, int]
"""A pool of timestamps, and the first of two in it."""


class Span:
    """Two timestamps around some work; they go back to the clock when nobody holds the span any more.

    Attributes:
        submission: the device's number for the work, once it was handed over.

    """

    def __init__(self, clock: Clock, place: Place) -> None:
        self._clock, self._place = clock, place
        self._ms: float | None = None
        self.submission: int | None = None

    @property
    def ms(self) -> float:
        """Milliseconds from its begin to its end; waits until the device is there."""
        if self._ms is None:
            if self.submission is None:
                raise RuntimeError("the time of work that was never handed to the device")
            self._ms = self._clock.read(self._place, self.submission)
        return self._ms

    def __del__(self) -> None:
        self._clock.give_back(self._place, self.submission)


class Clock:
    """Hands out spans, as many as are held at once."""

    def __init__(self, device: spy.Device) -> None:
        self._device = device
        self._free: deque[Place] = deque()
        self._resting: deque[tuple[Place, int]] = deque()

    def begin(self, encoder: spy.CommandEncoder) -> Span:
        """A span that begins here."""
        pool, first = place = self._take()
        pool.reset(first, 2)
        encoder.write_timestamp(pool, first)
        return Span(self, place)

    def end(self, encoder: spy.CommandEncoder, span: Span) -> None:
        """Where the span ends."""
        pool, first = span._place
        encoder.write_timestamp(pool, first + 1)

    def read(self, place: Place, submission: int) -> float:
        """Milliseconds of a span, once the device has done its work."""
        self._device.wait_for_submit(submission)
        pool, first = place
        begin, end = pool.get_timestamp_results(first, 2)
        return float(end - begin) * 1e3

    def give_back(self, place: Place, submission: int | None) -> None:
        """The place may be taken again as soon as the device writes no more into it."""
        if submission is None:
            self._free.append(place)
        else:
            self._resting.append((place, submission))

    def _take(self) -> Place:
        while self._resting and self._device.is_submit_finished(self._resting[0][1]):
            self._free.append(self._resting.popleft()[0])
        if not self._free:
            pool = self._device.create_query_pool(import_slangpy().QueryType.timestamp, 2 * _SPANS)
            self._free.extend((pool, 2 * i) for i in range(_SPANS))
        return self._free.popleft()


class DeviceClock:
    """The clock of one frame: what the device took for the work that each stage handed to it.

    A stage may hand over several pieces; they are added up. One that handed over none was done by the host, by whose
    clock it is timed then.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._spans: dict[str, list[Span]] = {}
        self._host_ms: dict[str, float] = {}

    @contextmanager
    def times(self, stage: str) -> Iterator[None]:
        """See :class:`~lab.engine.clock.StageClock`."""
        start = time.perf_counter()
        with self._gpu.collecting(self._spans.setdefault(stage, [])):
            yield
        self._host_ms[stage] = (time.perf_counter() - start) * 1e3

    @property
    def stages_ms(self) -> StageTimes:
        """See :class:`~lab.engine.clock.StageClock`; to look at them waits for the device."""
        return StageTimes(self._read)

    def _read(self) -> dict[str, float]:
        return {
            stage: sum(span.ms for span in self._spans[stage]) if self._spans[stage] else host_ms
            for stage, host_ms in self._host_ms.items()
        }
