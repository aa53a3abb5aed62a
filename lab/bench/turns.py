"""Measurements that are compared take turns, so that a busy moment of the machine meets all of them alike."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import TypeVar

from lab.bench.spread import Spread, spread

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class Turn:
    """One of them: `take` measures once and returns milliseconds (or rates) by name; in every `every`-th round."""

    take: Callable[[], dict[str, float]]
    every: int = 1


def take_turns(turns: dict[Key, Turn], rounds: int, tell: Callable[[float, Key], None]) -> dict[Key, dict[str, Spread]]:
    """Each turn once as a warm-up, then `rounds` rounds of all: spreads by the turn's key and the measurement's name.

    `tell` is called with the share of turns that is done, 0 to 1, and the key of the next.
    """
    found: dict[Key, dict[str, list[float]]] = {key: {} for key in turns}
    order = [(-1, key, turn) for key, turn in turns.items()]
    for number in range(rounds):
        order += [(number, key, turn) for key, turn in turns.items() if number % turn.every == 0]
    for done, (number, key, turn) in enumerate(order):
        tell(done / len(order), key)
        for measured, value in turn.take().items():
            if number >= 0:
                found[key].setdefault(measured, []).append(value)
    return {key: {measured: spread(values) for measured, values in by.items()} for key, by in found.items()}
