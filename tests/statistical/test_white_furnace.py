"""A closed room whose walls all glow alike has the same radiance everywhere: a geometric series of its albedo."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.reference import Budget, path_traced
from lab.scene.scene import Camera, Material, Mesh

from ..oracle_geometry.scenes import Array, box, scene_of
from ..oracle_geometry.statistics import accept, block_means, welch_test

EMISSION = np.array([2.0, 1.0, 0.5])
ALBEDO = np.array([0.9, 0.5, 0.2])
CAMERA = Camera("inside", (0.1, -0.2, 0.15), (1.0, 0.3, -0.4), fov_y_deg=100.0)
SIZE, BLOCK = (16, 16), 4
SEEDS = 20


def ball(rings: int = 32) -> Mesh:
    """A closed polyhedron around the origin, faces inward, so round that neighbouring faces hardly see each other."""
    angle = np.pi * np.arange(rings + 1) / rings
    turn = np.pi * np.arange(2 * rings) / rings
    unit = [np.outer(np.sin(angle), np.cos(turn)), np.outer(np.cos(angle), np.ones_like(turn))]
    position = np.stack([*unit, np.outer(np.sin(angle), np.sin(turn))], axis=-1)
    row, column = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    a, b = row * 2 * rings + column, row * 2 * rings + (column + 1) % (2 * rings)
    c, d = a + 2 * rings, b + 2 * rings
    index = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, c, d), (a, d, b))])
    corner = position.reshape(-1, 3)[index]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return Mesh(position.reshape(-1, 3).astype(np.float32), index[area > 1e-9].astype(np.uint32))


ROOMS = {"box": box((-1, -0.7, -0.9), (1.1, 0.8, 1), inward=True), "ball": ball()}


@cache
def furnace(room: str) -> CpuEngine:
    walls = Material("walls", tuple(ALBEDO.tolist()), emission=tuple(EMISSION.tolist()))
    return CpuEngine(scene_of([ROOMS[room]], [walls]))


def series(bounces: int) -> Array:
    """Emission that has bounced 1 .. `bounces` times."""
    return np.asarray(EMISSION * sum(ALBEDO**i for i in range(1, bounces + 1)))


@cache
def layers(bounces: int, pixel: str) -> tuple[Array, Array]:
    """(seeds, H / 4, W / 4, 3) direct and indirect light in the ball, means over blocks of pixels."""
    found = [
        path_traced(
            furnace("ball"), CAMERA, SIZE, Params(max_bounces=bounces, seed=seed), budget=Budget(spp=32), pixel=pixel
        )
        for seed in range(1, SEEDS + 1)
    ]
    direct, indirect = (np.stack([getattr(f, name) for f in found]) for name in ("direct", "indirect"))
    return tuple(  # type: ignore[return-value]
        np.stack([block_means(layer[..., c], BLOCK) for c in range(3)], axis=-1) for layer in (direct, indirect)
    )


def agrees(found: Array, radiance: Array) -> bool:
    """Every block on its own, and the picture's mean, in every channel.

    A wall seen from beside its edge with the next one is lit as 1/d^2: rare, bright samples, which a t-test takes too
    seriously. The ball leaves very few of them; 0.2 % of the radiance is allowed for those.
    """
    blocks = welch_test(found, np.broadcast_to(radiance, (1, *found.shape[1:])), rounding=2e-3 * radiance)
    return accept(blocks) and accept(welch_test(found.mean(axis=(1, 2)), radiance[None], rounding=2e-3 * radiance))


@pytest.mark.parametrize(("bounces", "pixel"), [(1, "centre"), (2, "area"), (5, "centre")])
def test_white_furnace(bounces: int, pixel: str) -> None:
    """Direct: emission, and the walls' emission reflected once. Indirect: what has bounced on the way, too."""
    direct, indirect = layers(bounces, pixel)
    assert agrees(direct, EMISSION + series(1))
    assert agrees(indirect, series(bounces + 1) - series(1))
    # What the same statistics tell apart: one bounce less or more, and 1 % too much.
    assert not agrees(indirect, series(bounces) - series(1))
    assert not agrees(indirect, series(bounces + 2) - series(1))
    assert not agrees(indirect, 1.01 * (series(bounces + 1) - series(1)))
    assert not agrees(direct, EMISSION + 1.01 * series(1))


@pytest.mark.parametrize("bounces", [1, 2, 4])
def test_white_furnace_in_a_box(bounces: int) -> None:
    """The median of several pictures: at a right angle the samples beside an edge have no variance to test with."""
    found = [
        path_traced(furnace("box"), CAMERA, SIZE, Params(max_bounces=bounces, seed=seed), budget=Budget(spp=256))
        for seed in range(1, 16)
    ]
    direct, indirect = (
        np.median([getattr(f, name).mean(axis=(0, 1)) for f in found], axis=0) for name in ("direct", "indirect")
    )
    assert direct == pytest.approx(EMISSION + series(1), rel=0.01)
    assert indirect == pytest.approx(series(bounces + 1) - series(1), rel=0.04)


@pytest.mark.parametrize("room", ROOMS)
def test_white_furnace_without_reflection_shows_its_walls(room: str) -> None:
    """Black walls: emission alone, exactly."""
    black = Material("black", (0.0, 0.0, 0.0), emission=tuple(EMISSION.tolist()))
    found = path_traced(CpuEngine(scene_of([ROOMS[room]], [black])), CAMERA, SIZE, Params(), budget=Budget(spp=4))
    assert np.array_equal(found.direct, np.broadcast_to(EMISSION, found.direct.shape))
    assert not found.indirect.any() and not found.colour_variance.any()
