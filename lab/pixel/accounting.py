"""Who answers for the difference between a frame's pixel and the sum over all input lights, light by light."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from lab import _core
from lab.colour import luminance
from lab.engine.cpu import CpuEngine
from lab.pixel.exact import expectation
from lab.pixel.inputs import InputLights
from lab.pixel.members import with_members
from lab.pixel.probing import probe_pixel, ratio_of, reaching_lights
from lab.pixel.records import Doubles
from lab.records import Frame


@dataclass(frozen=True)
class Account:
    """The indirect irradiance of a pixel, of the frame and in truth, split among its grid lights.

    The *truth* is the sum over all input lights j of T_j, what j sends at its own place with its own shadow ray. The
    *frame* is its unshadowed irradiance times its shadow ratio R (what ``compensation`` brings back left out).

    Grid light i holds the share w_ij of input light j's flux (its trilinear weights, through the level-1 lights where
    levels are gathered), and is blended in with B_i: the pixel holds j h_j = sum_i B_i w_ij times. Blend weights go by
    the distances of grid lights, not of their members, so that h_j is 1 on no more than average; near coarse lights it
    is 2 and more. T_j is divided among the lights that hold j, in proportion to how much of it: i stands for
    sum_j T_j B_i w_ij / max(1, h_j), and what of T_j is held by none, max(0, 1 - h_j), is the *remainder*. What i sends
    in the frame is c_i R. With interleaving, lights of all tiles are taken, each counted once; the *recombination* is
    what tiles and their recombining make of it (and, without them, rounding). So

        sum of all `difference` + remainder + recombination = frame - truth.

    Attributes:
        index, level, blend_weight: (n,) lights that send something, or stand for something; ascending.
        sent: (n, 3) unshadowed irradiance c_i.    shadowed: (n, 3) c_i times the frame's own, filtered ratio R.
        shadowed_alone: (n, 3) c_i times the light's own ratio, from every ray (see :class:`ExactShadow`): without
            noise, and without the shadow of other lights.
        stands_for: (n, 3) its part of the truth.    difference: (n, 3) shadowed - stands_for.
        remainder: (3,) light that is missing, 0 or below.    recombination, frame, truth: (3,).
        times_held: mean of h_j, weighted by the luminance of T_j; NaN where nothing arrives.
        rays: traced for it.
    """

    x: int
    y: int
    index: NDArray[np.int64]
    level: NDArray[np.int32]
    blend_weight: Doubles
    sent: Doubles
    shadowed: Doubles
    shadowed_alone: Doubles
    stands_for: Doubles
    difference: Doubles
    remainder: Doubles
    recombination: Doubles
    frame: Doubles
    truth: Doubles
    times_held: float
    rays: int

    def sorted(self) -> Account:
        """The lights that answer for most, of either sign, first."""
        order = np.argsort(-np.abs(luminance(self.difference)), kind="stable")
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        rows = {name: value[order] for name, value in values.items() if name in _PER_LIGHT}
        return Account(**values | rows)


_PER_LIGHT = frozenset(
    ["index", "level", "blend_weight", "sent", "shadowed", "shadowed_alone", "stands_for", "difference"]
)


def account(engine: CpuEngine, frame: Frame, x: int, y: int, *, points: int = 256, seed: int = 0) -> Account:
    """The account of pixel (x, y); `points` and `seed` as of :func:`exact_shadow`, for `shadowed_alone` alone.

    Errors: :class:`LabError` for a pixel outside of the image.
    """
    frame = replace(frame, params=frame.params.replace(interleave=1))  # the lights of all tiles
    probe = probe_pixel(engine, frame, x, y)
    hierarchy = frame.hierarchy
    inputs = InputLights(engine, frame, probe.x, probe.y)
    expected = expectation(engine, frame, probe, inputs, points=points, seed=seed)
    found = reaching_lights(engine, frame, probe.x, probe.y)
    index = found["index"].astype(np.int64)

    received = inputs.received()
    truth = received.sum(axis=0)
    # Shadow points are drawn by these very shares of flux, times luminance.
    bright = np.asarray(luminance(hierarchy.flux.astype(np.float64)), np.float64)
    blend = found["blend_weight"].astype(np.float64)
    holding = np.zeros(len(bright))
    holding[index] = blend * bright[index]
    whole = with_members(hierarchy, frame.params)
    own = np.where(bright[: len(received)] > 0, bright[: len(received)], np.inf)
    held = _core.member_sums(whole, holding) / own
    per_flux = received / (np.maximum(1, held) * own)[:, None]
    stands_for = holding[index][:, None] * _core.member_means(whole, np.ascontiguousarray(per_flux))[index]
    weight = np.asarray(luminance(received), np.float64)

    contribution = found["contribution"].astype(np.float64)
    ratio = np.broadcast_to(frame.image.shadow_ratio[probe.y, probe.x].astype(np.float64), 3)
    alone = np.zeros_like(contribution)
    share = expected.light_shadowed
    if frame.params.shadow_estimator != "corrected":
        share = np.nan_to_num(ratio_of(share, expected.light_weight))
    lit = found["bright"] > 0
    alone[lit] = contribution[lit] * share[:, None]
    shadowed = contribution * ratio
    kept = lit | stands_for.any(axis=1)
    of_frame = frame.image.unshadowed[probe.y, probe.x].astype(np.float64) * ratio
    return Account(
        x=probe.x,
        y=probe.y,
        index=index[kept],
        level=found["level"][kept],
        blend_weight=blend[kept],
        sent=contribution[kept],
        shadowed=shadowed[kept],
        shadowed_alone=alone[kept],
        stands_for=stands_for[kept],
        difference=(shadowed - stands_for)[kept],
        remainder=0.0 - (np.maximum(0, 1 - held)[:, None] * received).sum(axis=0),
        recombination=of_frame - shadowed.sum(axis=0),
        frame=of_frame,
        truth=truth,
        times_held=float(weight @ held / weight.sum()) if weight.any() else float("nan"),
        rays=inputs.rays if frame.params.shadow_points == "members" else inputs.rays + expected.rays,
    )
