"""Estimates that get better the longer they run, and when they are good enough."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lab import interrupts
from lab.colour import luminance
from lab.errors import LabError

Doubles = NDArray[np.float64]
Progress = Callable[[float, str], None]
"""Called with the share that is done, 0 to 1, and a line about it."""

_SAVE_EVERY, _ERROR_EVERY = 60.0, 3.0  # seconds


@dataclass(frozen=True)
class Budget:
    """How long to refine: until whichever comes first. With nothing given, the method's own number of samples.

    Attributes:
        spp: samples a pixel: camera paths, or virtual lights drawn.
        error: relative standard error of the indirect layer (:attr:`Reference.relative_error`).
        seconds: time, of this run alone.
    """

    spp: int | None = None
    error: float | None = None
    seconds: float | None = None

    def __post_init__(self) -> None:
        if self.spp is not None and not (isinstance(self.spp, int) and 1 <= self.spp < 2**31):
            raise LabError(f"spp={self.spp}: expected a whole number from 1 to {2**31 - 1} of samples a pixel")
        for name in ("error", "seconds"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise LabError(f"{name}={value}: expected a number over 0")

    @property
    def open(self) -> bool:
        """Whether nothing was asked for."""
        return self.spp is None and self.error is None and self.seconds is None


@dataclass(frozen=True)
class Reference:
    """A reference picture and what is known about its noise. All images (H, W, 3) float64, linear RGB radiance.

    Attributes:
        method: ``path_tracer`` or ``brute_force``.
        direct: emission that is seen, and light straight from the scene's lights.
        indirect: light that has bounced; for ``brute_force`` over a scene's own light list, the light of that list.
        direct_variance, indirect_variance, colour_variance: variance of these means; 0 where they are exact.
        samples: camera paths, or virtual lights drawn, a pixel.
        exact: no noise is left: every light was summed, every shadow ray traced.
        seconds: time it took, earlier runs that it goes on from included.
        unshadowed: ``brute_force``: irradiance of the same lights without any shadow, exact; else None.
        reused: of `samples`, those of earlier runs, from disk.
    """

    method: str
    direct: Doubles
    indirect: Doubles
    direct_variance: Doubles
    indirect_variance: Doubles
    colour_variance: Doubles
    samples: int
    exact: bool
    seconds: float
    unshadowed: Doubles | None = None
    reused: int = 0

    @property
    def colour(self) -> Doubles:
        """``direct + indirect``."""
        return self.direct + self.indirect

    @property
    def relative_error(self) -> float:
        """Mean standard error of a pixel's indirect luminance over its mean; of colour where nothing is indirect."""
        for layer, variance in ((self.indirect, self.indirect_variance), (self.colour, self.colour_variance)):
            mean = float(luminance(layer).mean())
            if mean > 0:
                # As if the channels had one cause: an upper bound, by the triangle inequality.
                return float(luminance(np.sqrt(variance)).mean()) / mean
        return 0.0


class Estimator(Protocol):
    """One method on one view. Adds samples piece by piece; its state is a plain dict of arrays and numbers.

    A piece of work that is broken off (Ctrl-C) leaves the state as it was before.
    """

    default_spp: int
    seconds: float

    @property
    def samples(self) -> int:
        """Samples a pixel in :meth:`reference`."""

    @property
    def pending(self) -> float:
        """Samples a pixel that the work on more of them is worth so far."""

    @property
    def exact(self) -> bool:
        """Nothing is left to refine."""

    def step(self, most: int | None, guess: int | None) -> None:
        """A second's worth of work, or less, on at most `most` more samples a pixel; `guess` may be enough."""

    def reference(self) -> Reference:
        """What is known so far."""

    def state(self) -> dict[str, Any]:
        """Everything needed to go on."""

    def restore(self, state: dict[str, Any]) -> None:
        """Takes up an earlier :meth:`state`."""


def refine(
    estimator: Estimator,
    budget: Budget,
    progress: Progress | None = None,
    checkpoint: Callable[[], None] | None = None,
) -> Reference:
    """Steps until the budget is met and returns the reference.

    `checkpoint` is called now and then, at the end, and when the run is interrupted, to keep what has been reached.
    """
    refinement = _Refinement(estimator, budget)
    saved, unsaved = time.monotonic(), False
    try:
        while (share := refinement.share()) < 1:
            interrupts.check()
            if progress:
                progress(share, refinement.said())
            refinement.step()
            unsaved = True
            if checkpoint and time.monotonic() - saved > _SAVE_EVERY:
                checkpoint()
                saved, unsaved = time.monotonic(), False
    finally:
        if checkpoint and unsaved:
            checkpoint()
    reference = estimator.reference()
    if progress:
        progress(1.0, f"{estimator.samples:,} samples a pixel, relative error {reference.relative_error:.2%}")
    return reference


class _Refinement:
    """How far one run is, and how much more it is worth asking for."""

    def __init__(self, estimator: Estimator, budget: Budget) -> None:
        self._estimator, self._budget = estimator, budget
        self._spp = estimator.default_spp if budget.open else budget.spp
        self._started = time.monotonic()
        self._error, self._error_of, self._error_at = 0.0, 0, -math.inf

    def _elapsed(self) -> float:
        return time.monotonic() - self._started

    def _relative_error(self, at_most_old: float = 0.0) -> float:
        """Of the samples so far; it may be some seconds old, as it takes a while to compute."""
        samples = self._estimator.samples
        if samples != self._error_of and self._elapsed() - self._error_at >= at_most_old:
            self._error = self._estimator.reference().relative_error
            self._error_of, self._error_at = samples, self._elapsed()
        return self._error

    def share(self) -> float:
        """The share of the budget that is used up; 1 and more: stop."""
        e, budget = self._estimator, self._budget
        if e.exact:
            return 1.0
        shares = [0.0]
        if self._spp is not None:
            shares.append((e.samples + min(e.pending, 0.999 * (self._spp - e.samples))) / self._spp)
        if e.samples == 0:  # nothing to show yet, whatever the clock says
            return min(max(shares), 0.999)
        if budget.seconds is not None:
            shares.append(self._elapsed() / budget.seconds)
        if budget.error is not None:
            error = self._relative_error()
            shares.append((budget.error / error) ** 2 if error > 0 else 1.0)
        return max(shares)

    def step(self) -> None:
        """One step of the estimator."""
        e, guesses = self._estimator, []
        most = None if self._spp is None else self._spp - e.samples
        if e.samples > 0 and self._budget.error is not None:
            guesses.append(e.samples * ((self._relative_error() / self._budget.error) ** 2 - 1))
        if e.samples > 0 and self._budget.seconds is not None and e.seconds > 0:
            guesses.append((self._budget.seconds - self._elapsed()) * e.samples / e.seconds)
        # An early error is only roughly known: it must not ask for too much.
        guess = max(1, math.ceil(min([*guesses, 3.0 * e.samples]))) if guesses else None
        begun = time.monotonic()
        e.step(most, guess)
        e.seconds += time.monotonic() - begun

    def said(self) -> str:
        """A line about it."""
        samples, pending = self._estimator.samples, round(self._estimator.pending)
        text = f"{samples:,} samples a pixel" + (f" and {pending:,} under way" if pending else "")
        if samples == 0:
            return text
        return f"{text}, relative error {self._relative_error(_ERROR_EVERY):.2%}"
