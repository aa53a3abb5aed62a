"""A pixel's shadow samples drawn again and again by the engine's own stages, against what they are expected to be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.metrics import chi_square
from lab.pixel.probing import pixel_of, probe_pixel, ratio_of
from lab.pixel.records import Doubles
from lab.records import Floats, Frame, GBuffer

MOST_DRAWS = 2**22
_COPIES_A_TURN = 4096


@dataclass(frozen=True)
class PickTrials:
    """Draws of one pixel's samples: `copies` of the pixel, k picks each. c = 3 for ``ratio_rgb``, else 1.

    Attributes:
        draws: copies * k.    index, level: (n,) lights that may be picked, ascending.
        probability: (n,) of each pick.    count: (n,) picks of each.
        statistic, freedom, p_value: of the chi-square test of `count` against `probability`.
        visible: (n,) picks whose ray was free, the ray going to a member drawn without regard to its omega.
        visible_share: (n,) visible / count, NaN where a light was not picked.
        shadowed, weight: (c,) means over the copies of S and of what it is relative to (U for the ratios).
        ratio: (c,) of these means.    mean_visibility: of all picks.
        shadowed_error, weight_error, ratio_error, mean_visibility_error: one standard error of each.
    """

    x: int
    y: int
    copies: int
    draws: int
    index: NDArray[np.int64]
    level: NDArray[np.int32]
    probability: Doubles
    count: NDArray[np.int64]
    statistic: float
    freedom: int
    p_value: float
    visible: NDArray[np.int64]
    visible_share: Doubles
    shadowed: Doubles
    shadowed_error: Doubles
    weight: Doubles
    weight_error: Doubles
    ratio: Doubles
    ratio_error: Doubles
    mean_visibility: float
    mean_visibility_error: float


def sample_pixel(engine: CpuEngine, frame: Frame, x: int, y: int, draws: int = 4096, *, seed: int = 0) -> PickTrials:
    """Draws the picks of pixel (x, y) `draws` times, rounded up to whole pixels of k, and traces their rays.

    The stages light and trace_shadow_rays do it, on a G-buffer of copies of the pixel in its interleaving tile, with
    the frame's settings but for `seed`. Visibility is counted in a second pass with ``shadow_estimator=average``: the
    ratios' samples go to one of several members by omega, which would prefer those that are seen.

    A pixel without lights has no draws. Errors: :class:`LabError` for a pixel outside of the image, a frame without
    shadow samples, and numbers of draws that are no numbers of draws.
    """
    x, y = pixel_of(frame.gbuffer.size, x, y)
    k = frame.params.shadow_samples
    if int(draws) != draws or not 1 <= draws <= MOST_DRAWS:
        raise LabError(f"draws={draws}: expected a whole number from 1 to {MOST_DRAWS}")
    if k == 0:
        raise LabError("this frame has shadow_samples=0: it picks no lights, there is nothing to draw again")
    lights = probe_pixel(engine, frame, x, y).lights
    lights = lights.take(lights.probability > 0)
    copies = -(-int(draws) // k) if len(lights) else 0
    picks, free, shadowed, weight = _draw(engine, frame, (x, y), copies, seed)

    row = np.searchsorted(lights.index, picks)
    known = np.append(lights.index, -1)[row] == picks
    if not known.all():
        raise LabError(f"pixel {x},{y}: light {int(picks[~known][0])} was picked, which does not light it")
    count = np.bincount(row.ravel(), minlength=len(lights))
    visible = np.bincount(row[free], minlength=len(lights))
    test = chi_square(count, lights.probability)
    s, u = _mean(shadowed), _mean(weight)
    ratio = ratio_of(s, u)
    gap = shadowed - np.nan_to_num(ratio) * weight  # of mean 0; its error is the ratio's, to first order
    each = free.mean(axis=1)[:, None] if copies else np.zeros((0, 1))
    return PickTrials(
        x=x,
        y=y,
        copies=copies,
        draws=copies * k,
        index=lights.index,
        level=lights.level,
        probability=lights.probability,
        count=count,
        statistic=test.statistic,
        freedom=test.freedom,
        p_value=test.p_value,
        visible=visible,
        visible_share=ratio_of(visible.astype(np.float64), count.astype(np.float64)),
        shadowed=s,
        shadowed_error=_error(shadowed),
        weight=u,
        weight_error=_error(weight),
        ratio=ratio,
        ratio_error=ratio_of(_error(gap), u),
        mean_visibility=float(_mean(each)[0]),
        mean_visibility_error=float(_error(each)[0]),
    )


def _draw(
    engine: CpuEngine, frame: Frame, pixel: tuple[int, int], copies: int, seed: int
) -> tuple[NDArray[np.int32], NDArray[np.bool_], Doubles, Doubles]:
    """Picks and whether their rays are free, (copies, k); S and its weight, (copies, c)."""
    params = frame.params.replace(direct_samples=0, compensation="none", seed=seed)
    n, k, channels = params.interleave, params.shadow_samples, frame.shadows.shadowed.shape[-1]
    picks, free = [np.zeros((0, k), np.int32)], [np.zeros((0, k), bool)]
    sums: dict[str, list[Any]] = {"shadowed": [np.zeros((0, channels))], "weight": [np.zeros((0, channels))]}
    for turn, first in enumerate(range(0, copies, _COPIES_A_TURN)):
        settings = params.replace(frame=turn)
        gbuffer, own = copied(frame.gbuffer, pixel, min(_COPIES_A_TURN, copies - first), n)
        lighting = engine.light(frame.hierarchy, gbuffer, settings, counts=False)
        shadows = engine.trace_shadow_rays(frame.hierarchy, gbuffer, lighting, settings)
        for name, parts in sums.items():
            parts.append(getattr(shadows, name)[own].astype(np.float64))
        if settings.shadow_points == "members" and settings.shadow_estimator != "average":
            average = settings.replace(shadow_estimator="average")
            shadows = engine.trace_shadow_rays(frame.hierarchy, gbuffer, lighting, average)
        picks.append(lighting.light[own])
        free.append(shadows.visible[own] > 0)
    shadowed, weight = (np.concatenate(parts) for parts in sums.values())
    return np.concatenate(picks), np.concatenate(free), shadowed, weight


def copied(gbuffer: GBuffer, pixel: tuple[int, int], copies: int, n: int) -> tuple[GBuffer, NDArray[np.bool_]]:
    """A G-buffer with `copies` of `pixel` = (x, y), each on its interleaving tile of n x n, and where they lie (H, W).

    All other pixels see nothing.
    """
    x, y = pixel
    across = int(np.ceil(np.sqrt(copies)))
    height, width = -(-copies // across) * n, across * n
    rows, columns = np.divmod(np.arange(copies), across)
    place = rows * n + y % n, columns * n + x % n
    own = np.zeros((height, width), bool)
    own[place] = True

    def plane(values: Floats) -> Floats:
        copy = np.zeros((height, width, *values.shape[2:]), np.float32)
        copy[place] = values[y, x]
        return copy

    g = gbuffer
    surfaces = GBuffer(
        plane(g.position),
        plane(g.normal),
        plane(g.geometric_normal),
        plane(g.albedo),
        plane(g.emission),
        plane(g.depth),
        g.pixel_angle,
    )
    return surfaces, own


def _mean(values: Doubles) -> Doubles:
    return values.mean(axis=0) if len(values) else np.full(values.shape[1], np.nan)


def _error(values: Doubles) -> Doubles:
    """Standard error of the mean of (copies, c); NaN for fewer than two."""
    if len(values) < 2:
        return np.full(values.shape[1], np.nan)
    return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)), np.float64)
