"""How far an indirect layer is from an exact one, with the noise of both taken off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.attribute.bench import Bench, Picture
from lab.colour import luminance
from lab.metrics import flip, floor_of

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """The numbers of one picture.

    Attributes:
        rel_mse: see :class:`Judge`.    rel_mse_error: standard error of that, as noise leaves it open.
        rel_mse_rest: relMSE of all but the worst thousandth of the pixels: single dark pixels can rule the mean.
        energy: sum over the sum of what it is compared with.    flip: mean HDR-FLIP of the colour, or None.
    """

    rel_mse: float
    rel_mse_error: float
    rel_mse_rest: float
    energy: float
    flip: float | None


class Judge:
    """Scores pictures of one view.

    relMSE is the mean of ((a - b)^2 - v) / (c^2 + e^2): a the picture, b what it is compared with, v the variance of
    the noise of both, e = 1 % of the truth's mean, and c the brute-force sum with what its clamp leaves out. c has
    nearly the truth's expectation and hardly any noise: dividing by the noisy truth itself would weigh its dark pixels
    too high. FLIP, from which no noise can be taken off, compares with c, too.
    """

    def __init__(self, bench: Bench, left_out: Picture | None) -> None:
        self.truth = Picture(bench.truth.indirect, bench.truth.indirect_variance)
        self.summed = Picture(bench.summed.indirect, bench.summed.indirect_variance)
        self.left_out = left_out
        self.compensated = self.truth
        if left_out is not None:
            self.compensated = Picture(
                self.summed.radiance + left_out.radiance, self.summed.variance + left_out.variance
            )
        self.epsilon = floor_of(self.truth.radiance)
        self._tiny = float(np.finfo(np.float64).tiny)
        self._scale2: Doubles = self.compensated.radiance**2 + max(self.epsilon**2, self._tiny)
        background = np.where(bench.seen[..., None], 0.0, np.asarray(bench.scene.background))
        self.direct: Doubles = bench.truth.direct + background
        if bench.light_list:
            self.direct = bench.summed.direct + background

    def score(self, picture: Picture, exact: Picture, shown: Doubles | None = None) -> Score:
        """`picture` against `exact`; FLIP is that of `shown`, a colour, where one is given."""
        error2 = (picture.radiance - exact.radiance) ** 2
        pixels = ((error2 - picture.variance - exact.variance) / self._scale2).mean(axis=-1).ravel()
        mean, left_open = float(pixels.mean()), float(pixels.std() / np.sqrt(pixels.size))
        few = max(1, pixels.size // 1000)
        rest = np.partition(pixels, -few)[:-few]
        whole = float(exact.radiance.sum())
        energy = float(picture.radiance.sum()) / whole if whole > 0 else 1.0
        seen = None if shown is None else flip(shown, self.colour(self.compensated))[0]
        return Score(mean, left_open, float(rest.mean()) if rest.size else mean, energy, seen)

    def colour(self, picture: Picture) -> Doubles:
        """With the exact direct light and the background."""
        return np.maximum(self.direct + picture.radiance, 0.0)

    def noise(self, picture: Picture) -> float:
        """The relMSE that the noise of a picture alone would have."""
        return float(np.mean(np.broadcast_to(picture.variance, self._scale2.shape) / self._scale2))

    def error_map(self, picture: Picture, exact: Picture) -> Doubles:
        """(H, W) signed error of the luminance, relative as in relMSE."""
        difference = np.asarray(luminance(picture.radiance - exact.radiance), np.float64)
        scale = np.asarray(luminance(self.compensated.radiance), np.float64)
        return difference / np.sqrt(scale**2 + max(self.epsilon**2, self._tiny))
