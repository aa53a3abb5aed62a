"""Stage build_hierarchy against a float64 oracle: every array of every level, and the rules the levels follow."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import lab
from lab.params import Params

from ..oracle import cases
from ..oracle import hierarchy as oracle
from ..oracle.pure import luminance

CONSTRUCTIONS = {
    "gather": {},
    "scatter": {"construction": "scatter"},
    "half_open": {"gather_range": "half_open"},
    "bare_moments": {"carry_moments": False},
    "by_count": {"centre_weight": "count"},
    "count_scattered": {"centre_weight": "count", "construction": "scatter"},
    "demo": {"gather_range": "half_open", "carry_moments": False, "centre_weight": "count", "bounds_scale": 1.1},
}


def build(lights, **settings):
    params = Params(**{"shadow_samples": 0, **settings})
    return lab.build_hierarchy(lights, params), params


def rows_of(vertex, wanted):
    """Row of each `wanted` vertex among `vertex`, -1 where it is not there."""
    where = {tuple(v): i for i, v in enumerate(vertex.tolist())}
    return np.array([where.get(tuple(v), -1) for v in wanted.tolist()], int)


def check_level(got, want: oracle.Level, compared):
    """One level against its oracle: the same vertices but for negligible ones, the same numbers within rounding.

    `compared`: share of the flux whose vertices must be sharp enough in float32 to be worth comparing.
    """
    total, size = want.flux.sum(axis=0).max(), got.cell_size
    row = rows_of(want.vertex, got.vertex)
    assert got.flux[row < 0].sum(initial=0) <= 1e-6 * total, "vertices that no light touches"
    missing = rows_of(got.vertex, want.vertex) < 0
    assert want.flux[missing].sum(initial=0) <= 1e-6 * total, "vertices lost"
    known = row[row >= 0]
    mine = row >= 0
    np.testing.assert_array_less(np.abs(got.flux[mine] - want.flux[known]), want.flux_error[known] + 1e-30)

    error = 2 * want.error[known]
    sharp = error < 0.05
    assert want.flux[known][sharp].sum() >= compared * want.flux.sum(), "too few vertices could be compared"
    pairs = [
        (got.position / size, want.position / size),
        (got.deviation.astype(np.float64) ** 2 / size**2, want.variance / size**2),
        (got.normal, want.normal),
        (got.normal_moment, want.normal_moment),
    ]
    for mine_values, want_values in pairs:
        off = np.abs(mine_values[mine] - want_values[known]).max(axis=1)
        assert np.all(off[sharp] <= error[sharp]), f"off by {(off / error)[sharp].max():.3g} of what rounding allows"


@pytest.mark.parametrize("settings", CONSTRUCTIONS.values(), ids=CONSTRUCTIONS)
@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
def test_every_level_matches_the_oracle(lights, settings):
    ill_placed = lights in (cases.outlier, cases.CLOUDS["far_away"])
    if lights is cases.outlier and settings is CONSTRUCTIONS["demo"]:
        settings = {**settings, "centre_weight": "flux"}  # by count, S1 lights of no flux and no precision decide
    lights = lights()
    hierarchy, params = build(lights, levels=4, **settings)
    want = oracle.all_levels(lights, hierarchy, params)
    assert hierarchy.top == 4
    for level, level_oracle in zip(hierarchy.levels[1:], want, strict=True):
        check_level(level, level_oracle, 0.85 if ill_placed else 0.99)


@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
def test_orientation_matches_the_oracle(lights):
    lights = lights()
    hierarchy, params = build(lights, levels=4)
    for level, want in zip(hierarchy.levels[1:], oracle.all_levels(lights, hierarchy, params), strict=True):
        row = rows_of(want.vertex, level.vertex)
        got = hierarchy.oriented[hierarchy.offset[level.level] : hierarchy.offset[level.level + 1]]
        clear = (row >= 0) & (level.flux.max(axis=1) > 1e-5 * level.flux.max())
        assert np.array_equal(got[clear] > 0, want.oriented[row[clear]])


def test_lights_without_weight_or_flux_do_not_orient():
    # The only light with a normal lies in a corner: its weight at the seven other vertices is 0.
    corner = [[-1, -1, -1], [1, 1, 1], [-1, -0.5, -0.5], [0.9, 0.5, 0.5]]
    normal = [[0, 1, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    hierarchy, _ = build(cases.make_lights(corner, np.ones((4, 3)), normal), levels=1)
    assert hierarchy.oriented[4:].tolist() == [1, 0, 0, 0, 0, 0, 0, 0]
    black_one = cases.make_lights(corner, [[0, 0, 0], [1, 1, 1], [1, 1, 1], [1, 1, 1]], normal)
    hierarchy, _ = build(black_one, levels=1)
    assert not hierarchy.oriented[4:].any()


@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
def test_grids_are_nested_in_one_cube_around_the_lights(lights):
    lights = lights()
    for scale in (1.0, 1.1, 2.0):
        hierarchy, _ = build(lights, levels=3, bounds_scale=scale)
        position = lights.position.astype(np.float64)
        low, high = position.min(axis=0), position.max(axis=0)
        top = (high - low).max() * scale
        rounding = 2e-7 * np.abs(position).max()
        sizes = hierarchy.cell_size.astype(np.float64)
        np.testing.assert_allclose(sizes[3], top, rtol=1e-6, atol=rounding)
        np.testing.assert_array_equal(sizes[1:3] * [4, 2], sizes[3])
        assert sizes[0] == sizes[1] / 2
        np.testing.assert_allclose(hierarchy.origin, (low + high) / 2 - top / 2, rtol=0, atol=2 * rounding + 1e-6 * top)


@pytest.mark.parametrize("settings", CONSTRUCTIONS.values(), ids=CONSTRUCTIONS)
@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
def test_every_level_holds_the_flux_of_the_lights(lights, settings):
    lights = lights()
    hierarchy, params = build(lights, levels=5, **settings)
    total = lights.flux.astype(np.float64).sum(axis=0)
    for level in hierarchy.levels:
        flux = level.flux.astype(np.float64).sum(axis=0)
        if level.level < 2 or params.gather_range == "inclusive":
            np.testing.assert_allclose(flux, total, rtol=1e-5)
        else:
            assert np.all(flux <= total * (1 + 1e-5))


def test_half_open_range_loses_flux():
    hierarchy, _ = build(cases.cloud(), levels=5, gather_range="half_open")
    kept = [float(level.flux.sum() / hierarchy.levels[0].flux.sum()) for level in hierarchy.levels]
    assert kept[1] == pytest.approx(1, rel=1e-5)
    assert all(0.5 < share < 0.995 for share in kept[2:4]), kept


@pytest.mark.parametrize("construction", ["gather", "scatter"])
def test_total_variance_and_centre_are_those_of_the_lights(construction):
    """Every level keeps the first moment; the second too, but for the spread that a gather's S1 lights carry inside."""
    lights = cases.cloud()
    hierarchy, _ = build(lights, levels=4, construction=construction)
    weight = luminance(lights.flux)[:, None]
    mean = (weight * lights.position).sum(axis=0) / weight.sum()
    square = (weight * lights.position.astype(np.float64) ** 2).sum(axis=0) / weight.sum()
    for level in hierarchy.levels[1:]:
        w = luminance(level.flux)[:, None]
        got_mean = (w * level.position).sum(axis=0) / w.sum()
        got_square = (w * (level.position.astype(np.float64) ** 2 + level.deviation**2)).sum(axis=0) / w.sum()
        np.testing.assert_allclose(got_mean, mean, atol=1e-5)
        np.testing.assert_allclose(got_square, square, atol=1e-5)


def test_without_carried_moments_the_inner_spread_is_lost():
    carried, bare = (build(cases.cloud(), levels=4, carry_moments=carry)[0].levels[4] for carry in (True, False))
    w = luminance(carried.flux)[:, None]
    assert (w * carried.deviation**2).sum() > 1.02 * (w * bare.deviation**2).sum()
    np.testing.assert_array_equal(carried.position, bare.position)  # weighted by flux, centres don't need them


@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
def test_order_inside_a_level(lights):
    lights = lights()
    hierarchy, _ = build(lights, levels=4)
    n = len(lights)
    assert sorted(hierarchy.input_index.tolist()) == list(range(n))
    for name in ("position", "flux", "normal"):
        np.testing.assert_array_equal(getattr(hierarchy, name)[:n], getattr(lights, name)[hierarchy.input_index])
    assert not hierarchy.deviation[:n].any()
    for level in hierarchy.levels:
        key = level.vertex[:, ::-1].tolist()  # z, y, x
        if level.level == 0:
            key = [(*k, i) for k, i in zip(key, hierarchy.input_index.tolist(), strict=True)]
            assert key == sorted(key), "level 0: cells in grid order, ties in input order"
        else:
            assert all(a < b for a, b in itertools.pairwise(key)), "grid order, each vertex once"
            assert level.vertex.max() <= 2 ** (4 - level.level)
    cell = hierarchy.levels[0].vertex.astype(np.float64)
    u = (hierarchy.position[:n].astype(np.float64) - hierarchy.origin) / hierarchy.cell_size[1]
    slack = 1e-5 + 4e-7 * np.abs(lights.position).max() / hierarchy.cell_size[1]
    assert np.all((u >= cell - slack) & (u <= cell + 1 + slack)), "level 0: vertex is the level-1 cell of the light"


def test_arrays_have_their_shapes_and_types():
    hierarchy, _ = build(cases.cloud(), levels=3)
    m, n = int(hierarchy.offset[-1]), 300
    shapes = {"position": (m, 3), "flux": (m, 3), "normal": (m, 3), "normal_moment": (m, 6), "deviation": (m, 3)}
    for name, shape in shapes.items():
        assert getattr(hierarchy, name).shape == shape and getattr(hierarchy, name).dtype == np.float32
    assert hierarchy.vertex.shape == (m, 3) and hierarchy.vertex.dtype == np.uint16
    assert hierarchy.oriented.shape == (m,) and hierarchy.oriented.dtype == np.uint8
    assert hierarchy.input_index.shape == (n,) and hierarchy.input_index.dtype == np.uint32
    assert hierarchy.offset.tolist()[:2] == [0, n] and hierarchy.cell_size.shape == (4,)
    assert [level.level for level in hierarchy.levels] == [0, 1, 2, 3]
    assert sum(len(level) for level in hierarchy.levels) == m


@pytest.mark.parametrize("count", [1, 2, 15, 17, 40, 100, 333, 1000, 4000])
@pytest.mark.parametrize("flat", [False, True], ids=["volume", "floor"])
def test_auto_levels_keep_s1_under_half_of_the_lights(count, flat):
    lights = cases.cloud(count, seed=count)
    if flat:
        lights = cases.make_lights(lights.position * [1, 0, 1], lights.flux, lights.normal)
    hierarchy, _ = build(lights)
    s1 = len(hierarchy.levels[1])
    assert s1 < count / 2 or hierarchy.top == 1
    deeper, _ = build(lights, levels=hierarchy.top + 1)
    assert len(deeper.levels[1]) >= count / 2, "one more level must break the rule"
    assert s1 == oracle.count_s1(lights, hierarchy.origin, hierarchy.cell_size[-1], hierarchy.top)


def test_auto_levels_stop_at_twelve():
    hierarchy, _ = build(cases.coincident())
    assert hierarchy.top == 12


@pytest.mark.parametrize("count, levels", [(1, 2), (6, 2), (7, 3), (51, 3), (52, 4), (410, 5), (1000, 5)])
def test_demo_levels(count, levels):
    """The smallest H with 8^H > 10 N."""
    assert 8**levels > 10 * count >= 8 ** (levels - 1)
    hierarchy, _ = build(cases.cloud(count), levels="demo")
    assert hierarchy.top == levels


@pytest.mark.parametrize("levels", ["auto", "demo", 1, 5, 12])
@pytest.mark.parametrize("construction", ["gather", "scatter"])
@pytest.mark.parametrize("normal", [(0.0, -0.6, 0.8), None], ids=["oriented", "isotropic"])
def test_one_light_is_every_grid_light(levels, construction, normal):
    light = cases.one_light(normal)
    hierarchy, _ = build(light, levels=levels, construction=construction)
    for level in hierarchy.levels:
        np.testing.assert_allclose(level.flux.sum(axis=0), light.flux[0], rtol=1e-5)
        main = level.flux[:, 0] > 1e-4 * light.flux[0, 0]
        np.testing.assert_allclose(level.position[main], np.tile(light.position, (main.sum(), 1)), atol=1e-6)
        np.testing.assert_allclose(level.normal[main], np.tile(light.normal, (main.sum(), 1)), atol=1e-4)
        assert level.deviation[main].max() <= 1e-2 * level.cell_size


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.0), (0.3, -2.0, 5.0), (1e5, -1e5, 3.0)])
@pytest.mark.parametrize("levels", ["auto", 1, 4])
def test_lights_in_one_point(at, levels):
    lights = cases.coincident(at=at)
    hierarchy, _ = build(lights, levels=levels)
    assert hierarchy.cell_size[-1] > 0
    magnitude = max(abs(x) for x in at)
    assert hierarchy.cell_size[-1] <= max(1e-4 * magnitude, 1e-6), "never more than a tiny multiple of the coordinates"
    for level in hierarchy.levels:
        assert all(np.isfinite(a).all() for a in (level.position, level.flux, level.normal, level.deviation))
        np.testing.assert_allclose(level.flux.astype(np.float64).sum(axis=0), lights.flux.sum(axis=0), rtol=1e-5)
        assert np.abs(level.position - np.float32(at)).max() <= 2e-7 * magnitude + level.cell_size * 1e-3


def test_black_lights_alone_leave_empty_levels():
    lights = cases.make_lights(cases.cloud(50).position, np.zeros((50, 3)), cases.cloud(50).normal)
    for construction in ("gather", "scatter"):
        hierarchy, _ = build(lights, levels=3, construction=construction)
        assert hierarchy.offset.tolist() == [0, 50, 50, 50, 50]


def test_light_too_dim_for_its_luminance_is_weighted_by_its_trilinear_weight():
    # Blue alone at 2^-28 of the brightest: its flux is seen by the fixed-point sums, its luminance (7 %) is not.
    position = [[0, 0, 0], [4, 4, 4], [3.5, 0.5, 0.25], [3.5, 0.25, 0.5]]
    flux = [[1, 1, 1], [1, 1, 1], [0, 0, 2**-28], [0, 0, 2**-28]]
    normal = [[0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]]
    lights = cases.make_lights(position, flux, normal)
    hierarchy, params = build(lights, levels=3)
    want = oracle.all_levels(lights, hierarchy, params)[0]
    level = hierarchy.levels[1]
    row = int(rows_of(level.vertex, np.array([[4, 0, 0]]))[0])
    row_want = int(rows_of(want.vertex, np.array([[4, 0, 0]]))[0])
    assert row >= 0
    np.testing.assert_allclose(level.position[row], want.position[row_want], atol=1e-5)
    np.testing.assert_allclose(level.normal[row], want.normal[row_want], atol=1e-5)
    np.testing.assert_allclose(level.deviation[row] ** 2, want.variance[row_want], atol=1e-5)
    share = 0.5 * 0.5 * 0.75  # both lights' trilinear weight: half a cell, half a cell, a quarter of one
    np.testing.assert_allclose(level.flux[row, 2], 2 * share * 2**-28, rtol=0.5)
    assert np.linalg.norm(level.normal[row]) == pytest.approx(0.5**0.5, abs=1e-5)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_scale_of_flux_does_not_matter(scale):
    lights = cases.cloud()
    scaled = cases.make_lights(lights.position, lights.flux * np.float32(scale), lights.normal)
    one, other = build(lights, levels=4)[0], build(scaled, levels=4)[0]
    np.testing.assert_array_equal(one.offset, other.offset)
    np.testing.assert_allclose(other.flux, one.flux * scale, rtol=1e-4, atol=1e-7 * scale)
    bright = one.flux.max(axis=1) > 1e-3 * one.flux.max()
    np.testing.assert_allclose(other.position[bright], one.position[bright], atol=1e-4)


@pytest.mark.parametrize("settings", CONSTRUCTIONS.values(), ids=CONSTRUCTIONS)
def test_order_of_the_lights_does_not_change_a_bit(settings):
    lights = cases.mixed_cloud()
    shuffle = np.random.default_rng(11).permutation(len(lights))
    shuffled = cases.make_lights(lights.position[shuffle], lights.flux[shuffle], lights.normal[shuffle])
    one, other = build(lights, **settings)[0], build(shuffled, **settings)[0]
    assert one.offset.tolist() == other.offset.tolist()
    for name in ("position", "flux", "normal", "normal_moment", "deviation", "vertex", "oriented"):
        a, b = getattr(one, name)[len(lights) :], getattr(other, name)[len(lights) :]
        assert a.tobytes() == b.tobytes(), name
