"""What a person did since the last frame, in plain words."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Press:
    """A key that went down (or repeats): ``w``, ``1``, ``escape``, ``f12`` ...; `shift`: while shift was held."""

    key: str
    shift: bool = False


@dataclass(frozen=True)
class Inputs:
    """Everything since the last frame that the panel had no use for.

    Attributes:
        pressed: keys, in order.    held: keys that are down, or were for a moment.
        look: pixels that the mouse went right and down while it looked around.    looking: whether it still does.
        wheel: notches, away from the person.

    """

    pressed: tuple[Press, ...] = ()
    held: frozenset[str] = frozenset()
    look: tuple[float, float] = (0.0, 0.0)
    looking: bool = False
    wheel: float = 0.0
