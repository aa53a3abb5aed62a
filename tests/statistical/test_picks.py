"""Shadow samples are picked in proportion f_i / F: alone, together, in any order of the lights, by both pickers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab import _core
from lab.engine.cpu import CpuEngine, build_hierarchy
from lab.params import Params
from lab.records import Lights

from ..oracle_geometry.grids import LUMINANCE, contributions, levels_of, pick_weights
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.statistics import accept, chi_square, same_distribution
from ..oracle_geometry.trials import Trials, draw

LIGHTS = wall_lights(3, 60)
COMMON = {"levels": 3, "alpha": 0.7}  # so that every level counts somewhere


def expected(t: Trials, params: Params) -> Any:
    """(p, m) f of each light, float64."""
    return pick_weights(t.hierarchy, contributions(t.hierarchy, t.position, t.normal, params, t.radius), params)


def pixel_p_values(t: Trials, f: Any) -> list[float]:
    """A chi-square for each receiver and each sample slot."""
    samples = range(t.light.shape[2])
    return [chi_square(t.counts(s)[p], f[p]) for p in range(len(f)) for s in samples]


@pytest.mark.parametrize("picker", ["reservoir", "race"])
@pytest.mark.parametrize("importance", [True, False])
@pytest.mark.parametrize("samples", [1, 4])
def test_picks_follow_the_target_weights(picker: str, importance: bool, samples: int) -> None:
    params = Params(picker=picker, importance=importance, shadow_samples=samples, **COMMON)
    t = draw(LIGHTS, params, copies=1000, frames=3)
    f = expected(t, params)
    assert ((f > 0).sum(axis=1) > 15).all()
    np.testing.assert_allclose(t.weight_sum, f.sum(axis=1), rtol=1e-4)
    assert accept(pixel_p_values(t, f))
    # The same statistic rejects probabilities that are nearly right.
    wrong = expected(t, params.replace(importance=not importance))
    assert not accept(pixel_p_values(t, wrong))
    assert not accept(pixel_p_values(t, f * np.where(np.arange(f.shape[1]) % 2, 1.4, 1.0)))


@pytest.mark.parametrize("picker", ["reservoir", "race"])
def test_many_lights_keep_their_probabilities(picker: str) -> None:
    """A pixel that chooses among 2,000 lights: no light is favoured because random bits run out on the way."""
    rng = np.random.default_rng(4)
    position = rng.uniform((-2, 0.5, -2), (2, 2, 2), (2000, 3)).astype(np.float32)
    lights = Lights(position, np.repeat(rng.uniform(0.5, 1.5, (2000, 1)), 3, axis=1).astype(np.float32))
    params = Params(picker=picker, levels=1, alpha=1e3, shadow_samples=64, clamp_distance=0.5)
    engine = CpuEngine(occluded_room(lights))
    h = engine.build_hierarchy(lights, params)
    at, up = np.array([0.8, 0.0, -0.2]), np.array([0.0, 1.0, 0.0])
    g = points_as_gbuffer(np.tile(at, (96, 96, 1)), np.tile(up, (96, 96, 1)))
    picks = engine.light(h, g, params).light
    f = pick_weights(h, contributions(h, at[None], up[None], params, engine.scene_radius), params)[0]
    assert (f > 0).sum() == 2000
    assert accept(chi_square(np.bincount(picks.ravel(), minlength=len(f)), f))


@pytest.mark.parametrize("picker", ["reservoir", "race"])
def test_samples_of_a_pixel_are_independent(picker: str) -> None:
    """Pairs of picks follow the product of their probabilities (few lights, so that every pair is common)."""
    params = Params(picker=picker, shadow_samples=3, levels=1, alpha=50.0)
    lights = wall_lights(8, 4, oriented=0.0)
    t = draw(lights, params, copies=1500, frames=3)
    f = expected(t, params)
    m = f.shape[1]
    p_values = []
    for p in range(len(f)):
        product = np.outer(f[p], f[p]).ravel()
        for a, b in ((0, 1), (0, 2), (1, 2)):
            pairs = t.light[:, p, a] * m + t.light[:, p, b]
            p_values.append(chi_square(np.bincount(pairs, minlength=m * m), product))
    assert accept(p_values)
    same = t.light.copy()
    same[..., 1] = same[..., 0]
    pairs = np.bincount(same[:, 0, 0] * m + same[:, 0, 1], minlength=m * m)
    assert not accept(chi_square(pairs, np.outer(f[0], f[0]).ravel()))


@pytest.mark.parametrize("picker", ["reservoir", "race"])
def test_neighbouring_pixels_and_frames_are_independent(picker: str) -> None:
    params = Params(picker=picker, shadow_samples=1, levels=1, alpha=50.0)
    t = draw(wall_lights(8, 4, oriented=0.0), params, copies=1500, frames=2)
    f = expected(t, params)
    m = f.shape[1]
    first, second = t.light[:1500, :, 0], t.light[1500:, :, 0]
    p_values = []
    for p in range(len(f)):
        between_frames = np.bincount(first[:, p] * m + second[:, p], minlength=m * m)
        p_values.append(chi_square(between_frames, np.outer(f[p], f[p]).ravel()))
        neighbour = (p + 1) % len(f)
        between_pixels = np.bincount(first[:, p] * m + first[:, neighbour], minlength=m * m)
        p_values.append(chi_square(between_pixels, np.outer(f[p], f[neighbour]).ravel()))
    assert accept(p_values)


@pytest.mark.parametrize("first", [0, 1, 2, 3, 12])
def test_first_shadow_level(first: int) -> None:
    """Only levels from min(first_shadow_level, top) up are picked from."""
    params = Params(first_shadow_level=first, shadow_samples=2, **COMMON)
    t = draw(LIGHTS, params)
    f = expected(t, params)
    assert t.hierarchy.top == 3
    level = levels_of(t.hierarchy)
    assert level[t.light].min() == min(first, 3)
    assert not f[:, level < min(first, 3)].any()
    np.testing.assert_allclose(t.weight_sum, f.sum(axis=1), rtol=1e-4)
    assert accept(pixel_p_values(t, f))


@pytest.mark.parametrize("picker", ["reservoir", "race"])
def test_all_levels_are_picked_from_where_the_wanted_ones_give_nothing(picker: str) -> None:
    """With wide blending, coarse levels start far outside the room: everything comes from the finest one."""
    params = Params(first_shadow_level=2, alpha=200.0, levels=3, shadow_samples=2, picker=picker)
    t = draw(LIGHTS, params)
    assert (levels_of(t.hierarchy)[t.light] == 0).all()
    f = expected(t, params)
    assert not f[:, levels_of(t.hierarchy) > 0].any()
    np.testing.assert_allclose(t.weight_sum, f.sum(axis=1), rtol=1e-4)
    assert accept(pixel_p_values(t, f))


def test_some_pixels_fall_back_and_others_do_not() -> None:
    """Receivers side by side in one tile: each for itself picks from coarse levels if those give it anything."""
    params = Params(first_shadow_level=1, levels=1, alpha=10.0, shadow_samples=1)
    lights = Lights(np.float32([[0, 1, 0], [0.2, 1, 0.1], [0.1, 1.1, 0]]), np.ones((3, 3), np.float32))
    h = build_hierarchy(lights, params)
    height = np.linspace(-0.5, 0.95, 210)
    at = np.stack([np.full(210, 0.1), height, np.zeros(210)], axis=1)
    up = np.tile([0.0, 1.0, 0.0], (210, 1))
    found = CpuEngine(occluded_room(lights)).light(h, points_as_gbuffer(at[None], up[None]), params)
    c = contributions(h, at, up, params, CpuEngine(occluded_room(lights)).scene_radius)
    coarse = (c[:, 3:] > 0).any(axis=(1, 2))
    assert 20 < coarse.sum() < 190
    assert coarse.sum() % 16 > 0  # the border lies inside a group of pixels that are lit together
    assert np.array_equal(found.light[0, :, 0] >= 3, coarse)
    assert np.array_equal(found.light[0, :, 0] >= 0, (c > 0).any(axis=(1, 2)))


@pytest.mark.parametrize("order", ["shuffled", "weakest first", "strongest first"])
@pytest.mark.parametrize("picker", ["reservoir", "race"])
def test_the_order_of_the_lights_does_not_matter(picker: str, order: str) -> None:
    """Lights in another order are picked as often as before, each by its own name."""
    params = Params(picker=picker, shadow_samples=2, levels=1, alpha=0.7)  # one cell: input order is visiting order
    power = LIGHTS.flux @ LUMINANCE
    rows = {
        "shuffled": np.random.default_rng(5).permutation(len(LIGHTS)),
        "weakest first": np.argsort(power),
        "strongest first": np.argsort(-power),
    }[order]
    other = Lights(LIGHTS.position[rows], LIGHTS.flux[rows], LIGHTS.normal[rows])  # type: ignore[index]
    a, b = draw(LIGHTS, params, copies=1500), draw(other, params, copies=1500)
    n = len(LIGHTS)
    counts = []
    for t, names in ((a, np.arange(n)), (b, rows)):
        visited = names[t.hierarchy.input_index]
        assert np.array_equal(visited, names), "the order in which lights are visited is the one under test"
        found = t.counts()
        by_name = found.copy()
        by_name[:, visited] = found[:, :n]
        counts.append(by_name)
        assert accept(pixel_p_values(t, expected(t, params)))
    assert accept([same_distribution(x, y) for x, y in zip(*counts, strict=True)])
    assert not np.array_equal(*counts)
    # By their place in the order, not by name, the two are told apart.
    assert not accept([same_distribution(x, y) for x, y in zip(counts[0], b.counts(), strict=True)])


def test_reservoir_and_race_agree() -> None:
    """One distribution, two ways to draw from it."""
    a, b = (draw(LIGHTS, Params(picker=picker, shadow_samples=4, **COMMON)) for picker in ("reservoir", "race"))
    assert accept([same_distribution(x, y) for x, y in zip(a.counts(), b.counts(), strict=True)])
    assert not np.array_equal(a.light, b.light)
    even = draw(LIGHTS, Params(importance=False, shadow_samples=4, **COMMON))
    assert not accept([same_distribution(x, y) for x, y in zip(a.counts(), even.counts(), strict=True)])


@pytest.mark.parametrize("deal_all", [False, True])
def test_interleaved_picks(deal_all: bool) -> None:
    """A pixel picks among its tile's lights; dealt lights weigh n^2 times theirs."""
    n = 2
    params = Params(interleave=n, deal_all=deal_all, shadow_samples=2, **COMMON)
    engine = CpuEngine(occluded_room(LIGHTS))
    h = engine.build_hierarchy(LIGHTS, params)
    size = 72
    at, up = np.array([0.8, 0.0, -0.2]), np.array([0.0, 1.0, 0.0])
    g = points_as_gbuffer(np.tile(at, (size, size, 1)), np.tile(up, (size, size, 1)))
    lighting = engine.light(h, g, params)
    f = pick_weights(h, contributions(h, at[None], up[None], params, engine.scene_radius), params)[0]
    p_values = []
    for tile in range(n * n):
        mine = []
        for level in range(h.top + 1):
            count = int(np.diff(h.offset)[level])
            dealt = deal_all or count >= n * n
            share = _core.dealt_tile(count, level, n) == tile
            mine.append(np.where(share, n * n, 0) if dealt else np.ones(count))
        wanted = f * np.concatenate(mine)
        picks = lighting.light[tile // n :: n, tile % n :: n].reshape(-1, 2)
        sums = lighting.weight_sum[tile // n :: n, tile % n :: n]
        assert np.allclose(sums, wanted.sum(), rtol=1e-4)
        counts = [np.bincount(picks[:, s], minlength=len(f)) for s in range(2)]
        p_values += [chi_square(c, wanted) for c in counts]
        assert not accept([chi_square(c, f) for c in counts]), "undealt probabilities"
    assert accept(p_values)
