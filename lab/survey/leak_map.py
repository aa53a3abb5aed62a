"""Where a frame's indirect light is brighter or darker than it should be, and the worst spots of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance
from lab.engine.cpu import CpuEngine
from lab.errors import LabError, nearest
from lab.metrics import energy_ratio, floor_of, rel_mse, rel_mse_noise, relative_error
from lab.records import Frame
from lab.reference import METHODS, Budget, Reference, render_reference
from lab.reference.estimate import Progress
from lab.scene.scene import Scene

Doubles = NDArray[np.float64]

EFFORTS = {
    "quick": Budget(error=0.1, seconds=20.0),
    "good": Budget(error=0.03, seconds=180.0),
    "fine": Budget(error=0.01, seconds=1800.0),
}
"""How long :func:`reference_of` refines: to this relative error of a pixel, or for so long."""

TOLERATED = 0.1
"""Relative errors up to this one do not count as brighter or darker."""


@dataclass(frozen=True)
class Spot:
    """A block of pixels whose light is wrong.

    Attributes:
        x, y: the pixel in it that is wrong the most in this direction.
        left, top, block: the block is ``block`` x ``block`` pixels from (left, top) on.
        error: of the block's light, over the reference's there (relative as in the map): > 0 too bright.
        noise: standard error of the reference's light there, on the same scale.
        weight: what is too much (or missing) in the block, as a share of the whole image's light; > 0.
    """

    x: int
    y: int
    left: int
    top: int
    block: int
    error: float
    noise: float
    weight: float


@dataclass(frozen=True)
class LeakMap:
    """The frame's indirect light against a reference's.

    Attributes:
        error: (H, W) signed relative error of the luminance, :func:`lab.metrics.relative_error`; > 0 too bright.
        noise: (H, W) standard error of the reference on the same scale: errors of this size mean nothing.
        difference: (H, W) the frame's luminance less the reference's.
        luminance, deviation: (H, W) of the reference, and its standard error.
        seen: (H, W) pixels that see a surface.
        energy_ratio, rel_mse, rel_mse_noise: of the indirect layer in RGB (:mod:`lab.metrics`).
        method: the reference's.
    """

    error: Doubles
    noise: Doubles
    difference: Doubles
    luminance: Doubles
    deviation: Doubles
    seen: NDArray[np.bool_]
    energy_ratio: float
    rel_mse: float
    rel_mse_noise: float
    method: str

    @property
    def brighter(self) -> float:
        """Share of the pixels that are too bright, as :meth:`shares` counts them."""
        return self.shares()[0]

    @property
    def darker(self) -> float:
        """Share of the pixels that are too dark, as :meth:`shares` counts them."""
        return self.shares()[1]

    def shares(self, tolerated: float = TOLERATED, deviations: float = 0.0) -> tuple[float, float]:
        """Shares of the pixels on surfaces that are brighter, and darker, by more than `tolerated`.

        With `deviations` only those whose error is over so many standard errors of the reference, too.
        """
        pixels = max(1, int(self.seen.sum()))
        least = np.maximum(tolerated, deviations * self.noise)
        brighter, darker = (int((self.seen & (sign * self.error > least)).sum()) for sign in (1, -1))
        return brighter / pixels, darker / pixels

    def smoothed(self, radius: int) -> Doubles:
        """(H, W) as `error`, but of the light averaged over the pixels on surfaces within `radius`, in a square.

        It shows what leaks through the noise of a quick reference. Errors: :class:`LabError` for a radius below 0.
        """
        if not (isinstance(radius, int) and radius >= 0):
            raise LabError(f"radius={radius}: expected a whole number of pixels, 0 or more")
        count = np.maximum(_window_sums(self.seen.astype(np.float64), radius), 1)
        wrong, right = (_window_sums(x * self.seen, radius) / count for x in (self.difference, self.luminance))
        scale = np.hypot(right, max(floor_of(self.luminance), float(np.finfo(np.float64).tiny)))
        return np.where(self.seen, wrong / scale, 0.0)

    def worst(self, count: int = 8, block: int = 16, deviations: float = 2.0) -> list[Spot]:
        """The `count` blocks of `block` x `block` pixels with the most light too much or missing, the worst first.

        Differences within a block are summed with their signs, so that noise goes and what leaks stays: relative
        errors weighed with the (floored) luminance they are relative to. Blocks don't overlap. There may be fewer
        where nothing else is wrong by more than `deviations` standard errors of the reference.

        Errors: :class:`LabError` for blocks that the image has no room for.
        """
        height, width = self.error.shape
        if not (isinstance(block, int) and 1 <= block <= min(height, width)):
            raise LabError(f"block={block}: expected a whole number from 1 to {min(height, width)}, the image's side")
        if not (isinstance(count, int) and count >= 1):
            raise LabError(f"count={count}: expected a whole number of spots, at least 1")
        tiny = float(np.finfo(np.float64).tiny)
        whole, area_floor = max(float(self.luminance.sum()), tiny), block * block * floor_of(self.luminance)
        noise = np.sqrt(np.maximum(_block_sums(self.deviation**2, block), 0))
        free = np.abs(_block_sums(self.difference, block))
        # What is left after sums of millions have been taken off each other is no light.
        free[free <= np.maximum(1e-9 * whole, deviations * noise)] = 0
        spots: list[Spot] = []
        while len(spots) < count:
            top, left = (int(i) for i in np.unravel_index(int(np.argmax(free)), free.shape))
            if free[top, left] == 0:
                break
            inside = slice(top, top + block), slice(left, left + block)
            wrong = float(self.difference[inside].sum())
            y, x = np.unravel_index(int(np.argmax(np.sign(wrong) * self.difference[inside])), (block, block))
            scale = max(float(np.hypot(self.luminance[inside].sum(), area_floor)), tiny)
            error, unsure = wrong / scale, float(noise[top, left]) / scale
            spots.append(Spot(left + int(x), top + int(y), left, top, block, error, unsure, abs(wrong) / whole))
            free[max(0, top - block + 1) : top + block, max(0, left - block + 1) : left + block] = 0
        return spots


def leak_map(frame: Frame, reference: Reference) -> LeakMap:
    """Compares the frame's indirect light with that of a reference of the same view, as from :func:`reference_of`.

    Errors: :class:`LabError` where their sizes differ.
    """
    size = reference.indirect.shape[1], reference.indirect.shape[0]
    if size != frame.gbuffer.size:
        sizes = [f"{width}x{height}" for width, height in (frame.gbuffer.size, size)]
        raise LabError(f"the frame has {sizes[0]} pixels and the reference {sizes[1]}: render both in one size")
    a, b = (np.asarray(luminance(x), np.float64) for x in (frame.image.indirect.astype(np.float64), reference.indirect))
    seen: NDArray[np.bool_] = frame.gbuffer.depth > 0
    error = np.nan_to_num(relative_error(a, b))
    # As if the channels had one cause: an upper bound, by the triangle inequality.
    deviation = np.asarray(luminance(np.sqrt(reference.indirect_variance)), np.float64)
    scale = np.hypot(b, max(floor_of(b), float(np.finfo(np.float64).tiny)))
    return LeakMap(
        error=error,
        noise=deviation / scale,
        difference=a - b,
        luminance=b,
        deviation=deviation,
        seen=seen,
        energy_ratio=energy_ratio(frame.image.indirect, reference.indirect),
        rel_mse=rel_mse(frame.image.indirect, reference.indirect),
        rel_mse_noise=rel_mse_noise(reference.indirect, reference.indirect_variance),
        method=reference.method,
    )


def reference_of(
    scene: Scene,
    frame: Frame,
    method: str = "path_tracer",
    effort: str | Budget = "quick",
    progress: Progress | None = None,
    *,
    engine: CpuEngine | None = None,
    cache: bool = True,
) -> Reference:
    """The reference of a frame's view and settings, taken up from disk where there is one.

    A `progress` that raises ends it within about a second; what was reached is kept on disk, and the next call goes on
    from there.

    Args:
        scene: the frame's.
        frame: its camera, size and settings are used.
        method: ``path_tracer``: what the scene looks like. ``brute_force``: what its virtual lights give, all summed.
        effort: one of :data:`EFFORTS`, or a budget.
        progress: called with the share that is done and a line, about every second.
        engine: one for `scene`, if there is one already.
        cache: False: neither read nor kept.

    Errors: :class:`LabError` for an unknown method or effort, and for a path tracer's reference of a scene lit by a
    list of lights: it has their light in another layer.
    """
    if isinstance(effort, str) and effort not in EFFORTS:
        raise LabError(f"unknown effort {effort!r}: there are {', '.join(EFFORTS)}{nearest(effort, EFFORTS)}")
    if method not in METHODS:
        raise LabError(f"unknown method {method!r}: there are {', '.join(METHODS)}{nearest(method, METHODS)}")
    if method == "path_tracer" and scene.light_list is not None:
        raise LabError(
            f"{scene.name} is lit by a list of lights, which a path tracer counts as direct light and the frame as "
            "indirect: take method=brute_force"
        )
    return render_reference(
        scene,
        method,
        frame.params,
        camera=frame.camera,
        size=frame.gbuffer.size,
        budget=EFFORTS[effort] if isinstance(effort, str) else effort,
        cache=cache,
        engine=engine,
        progress=progress,
    )


def _block_sums(values: Doubles, block: int) -> Doubles:
    """(H - block + 1, W - block + 1) sums of the blocks that begin at each pixel."""
    table = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    sums: Doubles = table[block:, block:] - table[:-block, block:] - table[block:, :-block] + table[:-block, :-block]
    return sums


def _window_sums(values: Doubles, radius: int) -> Doubles:
    """(H, W) sums over the square of 2 radius + 1 pixels around each, as far as the image goes."""
    return _block_sums(np.pad(values, radius), 2 * radius + 1)
