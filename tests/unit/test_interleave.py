"""Interleaved lighting: every light goes to one tile and counts n^2 there, so that the tiles' mean loses nothing."""

from __future__ import annotations

import numpy as np
import pytest

import lab
from lab import _core
from lab.params import Params

from ..oracle import cases
from ..oracle import lighting as oracle

RADIUS = 1.5
TILES = [2, 4, 8]


def light(hierarchy, position, normal, shape, **settings):
    params = Params(**{"shadow_samples": 0, **settings})
    return _core.light(hierarchy, cases.as_gbuffer(position, normal, shape), params.to_core(), RADIUS), params


def same_point(pixels):
    """One point and normal, `pixels` times."""
    return np.tile([[0.2, 0.1, 0.5]], (pixels, 1)), np.tile([[0.6, 0.0, -0.8]], (pixels, 1))


def is_dealt(count, n, deal_all):
    return deal_all or count >= n * n


@pytest.fixture(scope="module")
def hierarchy():
    return lab.build_hierarchy(cases.cloud(), Params(shadow_samples=0, levels=4))


@pytest.mark.parametrize("n", TILES)
@pytest.mark.parametrize("deal_all", [False, True])
@pytest.mark.parametrize("lobe", ["moments", "mean"])
def test_mean_over_tiles_is_the_whole_light(hierarchy, n, deal_all, lobe):
    whole, _ = light(hierarchy, *same_point(1), (1, 1), lobe=lobe)
    tiles, _ = light(hierarchy, *same_point(n * n), (n, n), lobe=lobe, interleave=n, deal_all=deal_all)
    mean = tiles["irradiance"].reshape(-1, 3).astype(np.float64).mean(axis=0)
    np.testing.assert_allclose(mean, whole["irradiance"][0, 0], rtol=1e-5)
    assert tiles["irradiance"].std() > 0.01 * mean.mean(), "tiles see different lights"


@pytest.mark.parametrize("n", TILES)
@pytest.mark.parametrize("deal_all", [False, True])
def test_every_light_is_counted_in_one_tile(hierarchy, n, deal_all):
    """Levels of fewer than n^2 lights are seen whole by every tile, unless all are dealt."""
    whole, _ = light(hierarchy, *same_point(1), (1, 1))
    tiles, _ = light(hierarchy, *same_point(n * n), (n, n), interleave=n, deal_all=deal_all)
    sizes = [len(level) for level in hierarchy.levels]
    assert n == 2 or any(size < n * n for size in sizes)
    for name in ("overdraw", "lights_used"):
        for level, size in enumerate(sizes):
            seen = whole[name][level].item()
            got = tiles[name][level].astype(int)
            if is_dealt(size, n, deal_all):
                assert got.sum() == seen
            else:
                assert np.all(got == seen)


@pytest.mark.parametrize("count, dealt", [(3, False), (4, True), (15, True)])
def test_a_level_of_n_squared_lights_is_dealt(count, dealt):
    lights = cases.cloud(count, seed=count)
    small = lab.build_hierarchy(lights, Params(shadow_samples=0, levels=1))
    tiles, _ = light(small, *same_point(4), (2, 2), interleave=2, alpha=1e4)
    assert tiles["overdraw"][0].sum() == (count if dealt else 4 * count)


@pytest.mark.parametrize("n", TILES)
@pytest.mark.parametrize("deal_all", [False, True])
def test_each_pixel_sees_its_tile(hierarchy, n, deal_all):
    """Pixel (x, y) is lit by the lights dealt to tile (x mod n, y mod n), n^2 times each, and by no others."""
    height, width = 2 * n + 1, 3 * n - 1
    position, normal = cases.points(height * width, seed=3)
    got, params = light(hierarchy, position, normal, (height, width), interleave=n, deal_all=deal_all)
    y, x = np.divmod(np.arange(height * width), width)
    tile_of = (y % n) * n + x % n
    for tile in range(0, n * n, max(1, n * n // 8)):
        mine = tile_of == tile

        def factor(level, count, tile=tile):
            if not is_dealt(count, n, deal_all):
                return np.ones(count)
            return np.where(_core.dealt_tile(count, level, n) == tile, float(n * n), 0.0)

        want = oracle.light(hierarchy, position[mine], normal[mine], params, RADIUS, tile=factor)
        lit = got["irradiance"].reshape(-1, 3)[mine]
        np.testing.assert_allclose(lit, want.irradiance, rtol=1e-4, atol=1e-4 * want.irradiance.mean() + 1e-9)
        counted = got["overdraw"].reshape(len(hierarchy.cell_size), -1)[:, mine]
        assert np.all((want.overdraw_least <= counted) & (counted <= want.overdraw_most))


@pytest.mark.parametrize("n", TILES)
def test_points_alike_in_expectation(hierarchy, n):
    """Over many points the tiles' light is unbiased: no tile is systematically brighter."""
    position, normal = cases.points(64, seed=4)
    ratio = []
    for x, nx in zip(position, normal, strict=True):
        at = np.tile(x, (n * n, 1)), np.tile(nx, (n * n, 1))
        tiles, _ = light(hierarchy, *at, (n, n), interleave=n)
        lit = tiles["irradiance"].reshape(-1, 3).sum(axis=1)
        if lit.sum() > 0:
            ratio.append(lit / lit.mean())
    mean, error = np.mean(ratio, axis=0), np.std(ratio, axis=0) / len(ratio) ** 0.5
    assert np.all(np.abs(mean - 1) < 6 * error + 0.02)
