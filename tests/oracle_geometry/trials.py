"""Many independent draws of the same few receivers: a G-buffer that repeats them, over several frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import Hierarchy, Lighting, Lights

from .scenes import Array, occluded_room, points_as_gbuffer


@dataclass(frozen=True)
class Trials:
    """Receivers in a lit room, and `copies` * `frames` draws of the samples of each.

    Attributes:
        position, normal: (p, 3).    radius: of the scene.    light: (trials, p, k) picks.
        weight_sum: (p,) F, the same in every trial.    shadowed, weight: (trials, p, c), or None where not traced.
    """

    position: Array
    normal: Array
    radius: float
    hierarchy: Hierarchy
    light: NDArray[np.int32]
    weight_sum: Array
    shadowed: Array
    weight: Array

    def counts(self, sample: int | None = None) -> NDArray[np.intp]:
        """(p, m) how often each light was picked, by one of the samples or by all."""
        picks = self.light if sample is None else self.light[..., sample : sample + 1]
        lights = len(self.hierarchy.position)
        return np.stack([np.bincount(picks[:, p].ravel(), minlength=lights) for p in range(picks.shape[1])])


POSITION = np.array(
    [(-1.5, 0, 1.5), (0.8, 0, -0.2), (1.1, 1.3, -1.9), (-2, 0.9, -0.6), (0.6, 1.2, -0.1), (-1.9, 0, -1.9)]
)
NORMAL = np.array([(0, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0.6, 0.8, 0)])


def draw(lights: Lights, params: Params, copies: int = 1000, frames: int = 2, trace: bool = False) -> Trials:
    """Draws at six receivers of :func:`scenes.occluded_room`."""
    engine = CpuEngine(occluded_room(lights))
    hierarchy = engine.build_hierarchy(lights, params)
    tile = (copies, 1, 1)
    gbuffer = points_as_gbuffer(np.tile(POSITION, tile), np.tile(NORMAL, tile))
    found: list[tuple[Any, ...]] = []
    for frame in range(frames):
        settings = params.replace(frame=frame)
        lighting: Lighting = engine.light(hierarchy, gbuffer, settings)
        assert (lighting.weight_sum == lighting.weight_sum[0]).all()
        if trace:
            shadows = engine.trace_shadow_rays(hierarchy, gbuffer, lighting, settings)
            found.append((lighting.light, shadows.shadowed, shadows.weight))
        else:
            found.append((lighting.light, np.zeros((copies, 6, 1)), np.zeros((copies, 6, 1))))
    light, shadowed, weight = (np.concatenate(plane) for plane in zip(*found, strict=True))
    one = points_as_gbuffer(POSITION[None], NORMAL[None])
    return Trials(
        position=one.position[0].astype(np.float64),
        normal=one.normal[0].astype(np.float64),
        radius=engine.scene_radius,
        hierarchy=hierarchy,
        light=light,
        weight_sum=lighting.weight_sum[0].astype(np.float64),
        shadowed=shadowed.astype(np.float64),
        weight=weight.astype(np.float64),
    )
