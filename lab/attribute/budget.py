"""The error budget: every approximation switched on alone, and off alone, and how the presets fare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.attribute.bench import Bench, Picture
from lab.attribute.score import Judge, Score
from lab.attribute.terms import Term
from lab.params import Params, Value

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """How long to measure: camera paths of the truth, lights drawn for the sum, short paths, frames averaged."""

    paths: int = 128
    draws: int = 256
    short_paths: int = 64
    frames: int = 2


@dataclass(frozen=True)
class Side:
    """A term on alone, or off alone.

    Attributes:
        sentence: what was compared with what.
        score: of the picture that was changed.
        effect: relMSE with the term less relMSE without it: above 0, it costs.
        effect_rest: the same of all but the worst thousandth of the pixels.
        energy_effect: the same of the energy ratio.
        difference: (H, W) relative luminance with the term less that without it.
        seconds: of the changed frame, without loading; None where it is no frame.
    """

    sentence: str
    score: Score
    effect: float
    effect_rest: float
    energy_effect: float
    difference: Doubles
    seconds: float | None = None

    @classmethod
    def between(
        cls, sentence: str, changed: Score, pair: tuple[Score, Score], difference: Doubles, seconds: float | None = None
    ) -> Side:
        """From the scores with and without the term, of which one is that of the `changed` picture."""
        with_it, without = pair
        return cls(
            sentence,
            changed,
            with_it.rel_mse - without.rel_mse,
            with_it.rel_mse_rest - without.rel_mse_rest,
            with_it.energy - without.energy,
            difference,
            seconds,
        )


@dataclass
class Row:
    """One term. `chosen` are the values in the frame, `active` says whether they approximate anything."""

    term: Term
    active: bool
    chosen: dict[str, Value]
    on: Side | None = None
    off: Side | None = None


@dataclass(frozen=True)
class Rung:
    """A stage on the way from the truth to the frame: its name, what it is, and its score against the truth."""

    name: str
    what: str
    score: Score


RUNGS = {
    "summed": "all virtual lights, every shadow ray, with what the clamp leaves out",
    "clamped": "all virtual lights, every shadow ray",
    "hierarchy": "the hierarchy of these lights, shadows converged, nothing else approximated",
    "converged": "the frame with converged, unfiltered shadows",
    "frame": "the frame",
}
RUNGS_OF_A_LIST = {**RUNGS, "summed": "all lights, every shadow ray, clamped"}
"""What there is between the truth and the frame; of a scene lit by its own list of lights, and of all others."""


@dataclass(frozen=True)
class FrameScore:
    """A whole frame: its preset, settings, score against the truth, and time without loading."""

    name: str
    params: Params
    score: Score
    seconds: float
    colour: Doubles
    indirect: Picture


@dataclass
class ErrorBudget:
    """Everything that was measured; see :func:`lab.attribute.attribute`."""

    bench: Bench
    judge: Judge
    effort: Effort
    frame: FrameScore
    rows: list[Row]
    ladder: list[Rung]
    presets: list[FrameScore]
    notes: list[str]
    seconds: float = 0.0
