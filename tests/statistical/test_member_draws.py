"""Members of a grid light are drawn by weight times luminance, and jittered points by their density."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine, build_hierarchy
from lab.params import Params
from lab.records import GBuffer, Lighting, Lights

from ..oracle_geometry.grids import LUMINANCE, member_shares
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.statistics import accept, chi_square, z_test

LIGHTS = wall_lights(3, 60)


def members(params: Params, lights: Lights, rows: list[int], copies: int) -> tuple[Any, Any]:
    """(copies, rows, k) input lights drawn from the lights `rows`, and the (rows, n) probabilities of each."""
    engine = CpuEngine(occluded_room(lights))
    h = engine.build_hierarchy(lights, params)
    shape = (copies, len(rows))
    g: GBuffer = points_as_gbuffer(np.tile([0.8, 0.0, -0.2], (*shape, 1)), np.tile([0.0, 1.0, 0.0], (*shape, 1)))
    k = params.shadow_samples
    plain = engine.light(h, g, params)
    chosen: Lighting = dataclasses.replace(
        plain,
        light=np.ascontiguousarray(np.tile(np.int32(rows)[None, :, None], (copies, 1, k))),
        target_weight=np.ones((*shape, k), np.float32),
        weight_sum=np.ones(shape, np.float32),
    )
    return engine.trace_shadow_rays(h, g, chosen, params).member, member_shares(h, params.construction)[rows]


def member_counts(params: Params, lights: Lights, rows: list[int], copies: int) -> tuple[Any, Any]:
    """(rows, n) how often each input light was drawn from the lights `rows`, and their probabilities."""
    member, share = members(params, lights, rows, copies)
    counts = np.stack([np.bincount(member[:, i].ravel(), minlength=len(lights)) for i in range(len(rows))])
    return counts, share


@pytest.mark.parametrize("construction", ["gather", "scatter"])
@pytest.mark.parametrize("level", [1, 2, 3])
def test_members_are_drawn_by_weight_times_luminance(construction: str, level: int) -> None:
    """Level 1 draws input lights; coarser levels draw a light of a finer one, then one of its own."""
    params = Params(construction=construction, levels=3, shadow_samples=4, member_candidates=1, seed=1)
    h = build_hierarchy(LIGHTS, params)
    rows = np.linspace(h.offset[level], h.offset[level + 1] - 1, 6).astype(int).tolist()
    counts, share = member_counts(params, LIGHTS, sorted(set(rows)), 2000)
    assert (counts.sum(axis=1) == 8000).all()
    assert accept([chi_square(c, p) for c, p in zip(counts, share, strict=True)])
    if level > 1:
        luminance = (LIGHTS.flux @ LUMINANCE)[h.input_index]
        wrong = [np.where(p > 0, p / luminance, 0) for p in share]
        assert not accept([chi_square(c, p) for c, p in zip(counts, wrong, strict=True)]), "without luminance"
        even = [(p > 0).astype(float) for p in share]
        assert not accept([chi_square(c, p) for c, p in zip(counts, even, strict=True)]), "evenly"


def few(copies: int, **changes: int) -> tuple[Any, Any]:
    """(copies, 4) draws among the four input lights of one grid light, and their (4,) probabilities."""
    lights = wall_lights(8, 4, oriented=0.0)
    params = Params(levels=1, shadow_samples=4, member_candidates=1).replace(**changes)
    found, share = members(params, lights, [len(lights) + 3], copies)
    assert (share > 0.02).sum() >= 2
    return found[:, 0], share[0]


def pair_p_value(first: Any, second: Any, share: Any) -> float:
    """p-value of two arrays of draws being independent, each with probabilities `share`."""
    pairs = np.bincount((first * 4 + second).ravel(), minlength=16)
    return chi_square(pairs, np.outer(share, share).ravel())


@pytest.mark.parametrize("change", [{"frame": 1}, {"seed": 1}])
def test_members_are_drawn_anew(change: dict[str, int]) -> None:
    """Another frame or seed draws members independently of the first: pairs follow the product."""
    first, share = few(2000)
    second, _ = few(2000, **change)
    assert accept(pair_p_value(first, second, share))
    assert not accept(pair_p_value(first, first, share))


def test_members_of_neighbours_are_independent() -> None:
    """So do the draws of two samples of one pixel, and of two pixels side by side."""
    found, share = few(4000)
    p_values = [pair_p_value(found[:, a], found[:, b], share) for a in range(4) for b in range(a)]
    p_values += [pair_p_value(found[:-1, a], found[1:, b], share) for a in range(4) for b in range(4)]
    assert accept(p_values)


def test_members_of_one_light_and_of_a_single_cell() -> None:
    """An input light is its own member; a grid light made of one light always draws it."""
    params = Params(levels=1, shadow_samples=4, member_candidates=1)
    lights = Lights(np.float32([[0, 1, 0]]), np.float32([[1, 1, 1]]))
    h = build_hierarchy(lights, params)
    counts, _ = member_counts(params, lights, list(range(len(h.position))), 50)
    assert (counts == 200).all()


def test_weak_lights_are_drawn_as_rarely_as_they_should() -> None:
    """One light of 50 holds half of the power: members follow, down to the weak ones' own order."""
    rng = np.random.default_rng(2)
    position = rng.uniform(0.9, 1.1, (50, 3)).astype(np.float32)
    flux = np.full((50, 3), 1.0, np.float32)
    flux[7] = 49.0
    params = Params(levels=1, shadow_samples=16, member_candidates=1)
    lights = Lights(position, flux)
    h = build_hierarchy(lights, params)
    rows = list(range(50, len(h.position)))
    counts, share = member_counts(params, lights, rows, 2000)
    strong = int(np.flatnonzero(h.input_index == 7)[0])
    assert 0.2 < share[:, strong].mean() < 0.8
    assert accept([chi_square(c, p) for c, p in zip(counts, share, strict=True)])
    weaker = np.where(np.arange(50) == strong, 0.9, 1.0) * share
    assert not accept([chi_square(c, p) for c, p in zip(counts, weaker, strict=True)])


def test_jitter_has_the_raised_cosines_spread() -> None:
    """Mean 0 and variance (1/3 - 2/pi^2) of (deviation_scale * pi * deviation)^2, axes independent."""
    params = Params(shadow_points="jitter", deviation_scale=0.5, shadow_samples=8, levels=2)
    engine = CpuEngine(occluded_room(LIGHTS))
    h = engine.build_hierarchy(LIGHTS, params)
    row = int(h.offset[2])
    g = points_as_gbuffer(np.tile([0.8, 0.0, -0.2], (500, 1, 1)), np.tile([0.0, 1.0, 0.0], (500, 1, 1)))
    lighting = engine.light(h, g, params)
    chosen = dataclasses.replace(lighting, light=np.full((500, 1, 8), row, np.int32))
    point = engine.trace_shadow_rays(h, g, chosen, params).point.reshape(-1, 3).astype(np.float64)
    xi = (point - h.position[row]) / (0.5 * np.pi * h.deviation[row].astype(np.float64))
    assert np.abs(xi).max() < 1 + 1e-4
    variance = 1 / 3 - 2 / np.pi**2
    assert accept(z_test(np.concatenate([xi, xi**2], axis=1), [0, 0, 0, *[variance] * 3], rounding=1e-4))
    cross = np.stack([xi[:, 0] * xi[:, 1], xi[:, 1] * xi[:, 2], xi[:, 0] * xi[:, 2]], axis=1)
    assert accept(z_test(cross, [0, 0, 0]))
    assert not accept(z_test(xi**2, [1.1 * variance] * 3))
