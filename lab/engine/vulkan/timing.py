"""How long the device takes for spans of work, by timestamps that it writes itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lab.engine.vulkan.adapters import import_slangpy

if TYPE_CHECKING:
    import slangpy as spy

_SPANS = 256


class Span:
    """Two timestamps around some work; they go back to the clock when nobody holds the span any more."""

    def __init__(self, clock: Clock, index: int) -> None:
        self._clock, self._index = clock, index
        self._ms: float | None = None

    @property
    def ms(self) -> float:
        """Milliseconds from its begin to its end; waits until the device is there."""
        if self._ms is None:
            self._ms = self._clock.read(self._index)
        return self._ms

    def __del__(self) -> None:
        self._clock.give_back(self._index)


class Clock:
    """Hands out spans, at most 256 at a time."""

    def __init__(self, device: spy.Device) -> None:
        spy = import_slangpy()
        self._device = device
        self._pool = device.create_query_pool(spy.QueryType.timestamp, 2 * _SPANS)
        self._free = list(range(_SPANS))

    def begin(self, encoder: spy.CommandEncoder) -> Span:
        """A span that begins here."""
        if not self._free:
            raise RuntimeError(f"more than {_SPANS} spans of time are held at once")
        index = self._free.pop()
        self._pool.reset(2 * index, 2)
        encoder.write_timestamp(self._pool, 2 * index)
        return Span(self, index)

    def end(self, encoder: spy.CommandEncoder, span: Span) -> None:
        """Where the span ends."""
        encoder.write_timestamp(self._pool, 2 * span._index + 1)

    def read(self, index: int) -> float:
        """Milliseconds of a span."""
        self._device.wait()
        begin, end = self._pool.get_timestamp_results(2 * index, 2)
        return float(end - begin) * 1e3

    def give_back(self, index: int) -> None:
        """The span may be handed out again."""
        self._free.append(index)
