"""The path tracer as an estimator: sums over camera paths."""

from __future__ import annotations

from typing import Any

import numpy as np

from lab.engine.cpu import CpuEngine
from lab.errors import LabError, nearest
from lab.params import Params
from lab.reference.estimate import Doubles, Reference
from lab.scene.scene import Camera

PIXELS = ("centre", "area")
_LAYERS = ("direct", "indirect", "colour")
_PATHS_A_STEP = 400_000  # about a second: often enough for a progress bar and for Ctrl-C
_MOST_A_STEP = 16


class PathTracer:
    """Diffuse paths with next-event estimation at every vertex; see ``core_cpp/src/trace_paths.cpp``."""

    default_spp = 256
    pending = 0.0
    exact = False

    def __init__(
        self, engine: CpuEngine, camera: Camera, size: tuple[int, int], params: Params, pixel: str = "centre"
    ) -> None:
        if pixel not in PIXELS:
            raise LabError(f"pixel={pixel}: allowed is {' | '.join(PIXELS)}{nearest(pixel, PIXELS)}")
        self._engine, self._params = engine, params
        self._camera = camera if pixel == "area" else None
        self._gbuffer = engine.render_gbuffer(camera, size)
        shape = (*self._gbuffer.depth.shape, 3)
        names = [f"{layer}{part}" for layer in _LAYERS for part in ("", "_square")]
        # Sums and their count, replaced as one: Ctrl-C between two would leave sums of different samples.
        self._state: dict[str, Any] = {name: np.zeros(shape) for name in names} | {"samples": 0}
        self.seconds = 0.0

    @property
    def samples(self) -> int:
        """Paths a pixel."""
        return int(self._state["samples"])

    def step(self, most: int | None, guess: int | None) -> None:
        """Adds about a second's worth of paths; enough for the clock and the error to be looked at in between."""
        del guess
        # Batches begin at multiples of one power of two: runs of 16, 32 ... samples sum in one order, to the last bit.
        batch = 1 << (max(1, min(_MOST_A_STEP, _PATHS_A_STEP // self._gbuffer.depth.size)).bit_length() - 1)
        count = batch - self.samples % batch
        count = count if most is None else min(most, count)
        found = self._engine.trace_paths(self._gbuffer, self._camera, self.samples, count, self._params)
        sums = {name: self._state[name] + found[name] for name in found}
        self._state = sums | {"samples": self.samples + count}

    def reference(self) -> Reference:
        """Means over all paths, and the variance of these means."""
        n = max(1, self.samples)
        mean = {layer: self._state[layer] / n for layer in _LAYERS}
        variance = {
            layer: mean_variance(self._state[layer], self._state[f"{layer}_square"], self.samples) for layer in _LAYERS
        }
        return Reference(
            "path_tracer",
            mean["direct"],
            mean["indirect"],
            variance["direct"],
            variance["indirect"],
            variance["colour"],
            self.samples,
            False,
            self.seconds,
        )

    def state(self) -> dict[str, Any]:
        """The sums."""
        return self._state | {"seconds": self.seconds}

    def restore(self, state: dict[str, Any]) -> None:
        """The sums."""
        sums = {name: np.array(state[name]) for name in self._state if name != "samples"}
        self._state = sums | {"samples": int(state["samples"])}
        self.seconds = float(state["seconds"])


def mean_variance(sums: Doubles, squares: Doubles, count: int) -> Doubles:
    """Variance of the mean of `count` samples, from their sum and the sum of their squares; inf for a single one."""
    if count < 2:
        return np.where(squares > 0, np.inf, 0.0)
    spread = squares - sums * sums / count
    # What rounding alone leaves of equal samples is no variance.
    spread = np.where(spread > 1e-12 * squares, spread, 0.0)
    return np.asarray(spread / (count - 1) / count, np.float64)
