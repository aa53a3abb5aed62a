"""The picks of stage light, one by one: what the last records of float64 numpy say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.params import Params

from ..oracle import pure
from ..oracle_geometry.grids import contributions, pick_weights
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.trials import NORMAL, POSITION

PICK = 3  # Stream::pick


@pytest.mark.parametrize(
    "settings",
    [
        {"levels": 3, "alpha": 0.7},
        {"levels": 3, "alpha": 0.7, "first_shadow_level": 2, "importance": False},
        {"levels": 1, "alpha": 1e3, "shadow_samples": 7, "seed": 3, "frame": 5},  # three batches
    ],
    ids=str,
)
def test_reservoir_picks_are_their_definition(settings: dict[str, Any]) -> None:
    lights = wall_lights(3, 60)
    engine = CpuEngine(occluded_room(lights))
    params = Params(**settings)
    hierarchy = engine.build_hierarchy(lights, params)
    copies = 150
    gbuffer = points_as_gbuffer(np.tile(POSITION, (copies, 1, 1)), np.tile(NORMAL, (copies, 1, 1)))
    picks = engine.light(hierarchy, gbuffer, params).light
    one = points_as_gbuffer(POSITION[None], NORMAL[None])
    at, facing = one.position[0].astype(float), one.normal[0].astype(float)
    f = pick_weights(hierarchy, contributions(hierarchy, at, facing, params, engine.scene_radius), params)
    key = pure.pcg4d([(params.seed, params.frame, 0x9E3779B9, 0x85EBCA6B)])[0, 0]
    for p in range(len(POSITION)):
        pixels = np.arange(copies) * len(POSITION) + p
        for s in range(params.shadow_samples):
            seeds = pure.pcg4d([(pixel, s // 4, PICK, key) for pixel in pixels])[:, s % 4]
            want = pure.reservoir_picks(f[p], seeds)
            assert len(np.unique(want)) > 4
            assert np.mean(picks[:, p, s] != want) < 0.02  # at most where rounding decides
