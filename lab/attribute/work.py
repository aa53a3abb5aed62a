"""A list of tasks whose lengths are roughly known, for a progress bar over all of them."""

from __future__ import annotations

from collections.abc import Callable

from lab import interrupts
from lab.reference.estimate import Progress

Part = Callable[[float], None]
"""Called with the share of a task that is done."""


class Work:
    """Tasks in the order they are to be done in."""

    def __init__(self) -> None:
        self._tasks: list[tuple[float, str, Callable[[Part], None]]] = []

    def add(self, length: float, line: str, do: Callable[[Part], None]) -> None:
        """`length` in any unit, the same for all; `line` says what is being done."""
        self._tasks.append((length, line, do))

    def run(self, progress: Progress | None) -> None:
        """Does all of it."""
        total, done = sum(length for length, _, _ in self._tasks), 0.0
        for length, line, do in self._tasks:

            def tell(part: float, done: float = done, length: float = length, line: str = line) -> None:
                interrupts.check()
                if progress:
                    progress(min(1.0, (done + part * length) / total), line)

            tell(0.0)
            do(tell)
            done += length
