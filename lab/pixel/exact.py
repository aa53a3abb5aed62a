"""What a pixel's shadow estimator expects: every pick, every member, every ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab import _core
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.pixel.inputs import InputLights
from lab.pixel.members import with_members
from lab.pixel.probing import probe_pixel, ratio_of
from lab.pixel.records import Doubles, Probe, ProbedLights
from lab.pixel.samples import copied
from lab.records import Frame, Lighting

MOST_POINTS = 2**11


@dataclass(frozen=True)
class ExactShadow:
    """The all-rays value of a pixel's shadow; c = 3 for ``ratio_rgb``, else 1. What is not known is NaN.

    Of a grid light, the mean over its members (as shadow points are drawn from them) or over its jittered points:

    Attributes:
        index, level: (n,) lights that light the pixel, ascending.
        probability: (n,) of each pick; 0 where a light is not picked from.
        visible_share: (n,) mean of V.    light_weight: (n,) mean of omega.    light_shadowed: (n,) mean of V omega.
            Of jittered points, and for ``average``, omega is 1.
        shadowed, weight: (c,) expectations of S and of what it is relative to.    ratio: (c,) of these, the frame's
            shadow ratio without noise and filter.    mean_visibility: expectation of the picks' mean V.
        rays: traced for it.    points: jittered points a light that were averaged over; 0: every ray was traced, and
            nothing is random.
        shadowed_error, ratio_error, mean_visibility_error: one standard error of each; 0 where nothing is random.
    """

    x: int
    y: int
    index: NDArray[np.int64]
    level: NDArray[np.int32]
    probability: Doubles
    visible_share: Doubles
    light_weight: Doubles
    light_shadowed: Doubles
    shadowed: Doubles
    shadowed_error: Doubles
    weight: Doubles
    ratio: Doubles
    ratio_error: Doubles
    mean_visibility: float
    mean_visibility_error: float
    rays: int
    points: int


def exact_shadow(engine: CpuEngine, frame: Frame, x: int, y: int, *, points: int = 256, seed: int = 0) -> ExactShadow:
    """The expectation, over picks and shadow points, of pixel (x, y)'s shadow samples.

    With ``shadow_points=members`` one ray goes to each input light that a light of the pixel is made of, and nothing
    is random. With ``jitter`` each light is judged by `points` of its jittered points, drawn by the engine's own stage
    from `seed`.

    Errors: :class:`LabError` for a pixel outside of the image, and for numbers of points that are none.
    """
    return expectation(engine, frame, probe_pixel(engine, frame, x, y), points=points, seed=seed)


def expectation(
    engine: CpuEngine, frame: Frame, probe: Probe, inputs: InputLights | None = None, *, points: int, seed: int
) -> ExactShadow:
    """:func:`exact_shadow` of a pixel that has been probed; `inputs` keep what they learn about their visibility."""
    if int(points) != points or not 2 <= points <= MOST_POINTS:
        raise LabError(f"points={points}: expected a whole number from 2 to {MOST_POINTS}")
    lights, params = probe.lights, frame.params
    jittered = params.shadow_points == "jitter"
    if jittered:
        visible, rays = _jittered(engine, frame, probe, int(points), seed)
        omega, seen = np.ones(len(lights)), visible
        many = lights.index >= len(frame.hierarchy.input_index)
        variance = np.where(many, visible * (1 - visible) / (points - 1), 0.0)
    else:
        inputs = inputs or InputLights(engine, frame, probe.x, probe.y)
        before = inputs.rays
        visible, omega, seen = _by_members(frame, lights, inputs)
        rays, variance = inputs.rays - before, np.zeros(len(lights))
        if params.shadow_estimator == "average":
            omega, seen = np.ones(len(lights)), visible

    p = lights.probability[:, None]
    # A sample counts omega; for ratio_rgb omega * c_i F / f_i, of which p_i leaves what all picked lights send.
    share = np.where(p > 0, lights.contribution, np.float64(0)) if params.shadow_estimator == "ratio_rgb" else p
    shadowed, weight = (share * seen[:, None]).sum(axis=0), (share * omega[:, None]).sum(axis=0)
    error = np.sqrt((share**2 * variance[:, None]).sum(axis=0))
    if params.shadow_estimator == "corrected" and len(lights):
        weight = np.ones(1)
    return ExactShadow(
        x=probe.x,
        y=probe.y,
        index=lights.index,
        level=lights.level,
        probability=lights.probability,
        visible_share=visible,
        light_weight=omega,
        light_shadowed=seen,
        shadowed=shadowed,
        shadowed_error=error,
        weight=weight,
        ratio=ratio_of(shadowed, weight),
        ratio_error=ratio_of(error, weight),
        mean_visibility=float(lights.probability @ visible) if len(lights) else float("nan"),
        mean_visibility_error=float(np.sqrt(lights.probability**2 @ variance)),
        rays=rays,
        points=int(points) if jittered else 0,
    )


def _by_members(frame: Frame, lights: ProbedLights, inputs: InputLights) -> tuple[Doubles, Doubles, Doubles]:
    """(n,) means over each light's members of V, of omega and of V omega."""
    hierarchy = with_members(frame.hierarchy, frame.params)
    cap = np.inf if frame.params.omega_max == "none" else float(frame.params.omega_max)
    means = np.zeros((3, len(lights)))
    whole = lights.receiver_cosine.astype(np.float64) * lights.emission
    for row, index in enumerate(lights.index):
        member, share = _core.member_shares(hierarchy, int(index))
        free = inputs.visible(member)
        # LY19 3.3, ours: a member's cosines over the grid light's; an input light stands for itself.
        alone = index < len(hierarchy.input_index)
        omega = np.ones(1) if alone else np.minimum(cap, inputs.facing[member] / whole[row])
        means[:, row] = share @ free, share @ omega, share @ (free * omega)
    return means[0], means[1], means[2]


def _jittered(engine: CpuEngine, frame: Frame, probe: Probe, points: int, seed: int) -> tuple[Doubles, int]:
    """(n,) mean V of each light over its jittered points, and the rays it took."""
    lights = probe.lights
    if len(lights) == 0:
        return np.zeros(0), 0
    # An input light is one point.
    tries = np.where(lights.index < len(frame.hierarchy.input_index), 1, points)
    pick = np.repeat(lights.index, tries).astype(np.int32)
    gbuffer, own = copied(frame.gbuffer, (probe.x, probe.y), len(pick), 1)
    light = np.full((*own.shape, 1), -1, np.int32)
    light[own, 0] = pick
    dark, ones = np.zeros((*own.shape, 3), np.float32), np.ones(own.shape, np.float32)
    lighting = Lighting(dark, None, None, light, target_weight=ones[..., None], weight_sum=ones)
    params = frame.params.replace(
        shadow_samples=1, shadow_estimator="average", direct_samples=0, compensation="none", seed=seed
    )
    shadows = engine.trace_shadow_rays(frame.hierarchy, gbuffer, lighting, params)
    free = shadows.visible[own, 0] > 0
    row = np.repeat(np.arange(len(lights)), tries)
    return np.bincount(row, weights=free, minlength=len(lights)) / tries, len(pick)
