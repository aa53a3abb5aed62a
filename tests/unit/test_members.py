"""Member lists: what each grid light is made of, in shares of trilinear weight times luminance (float64 oracle)."""

from __future__ import annotations

import numpy as np
import pytest

import lab
from lab.params import Params

from ..oracle import cases
from ..oracle.pure import luminance

SETTINGS = {
    "gather": {},
    "scatter": {"construction": "scatter"},
    "half_open": {"gather_range": "half_open"},
    "by_count": {"centre_weight": "count"},
}


def build(lights, **settings):
    return lab.build_hierarchy(lights, Params(**{"levels": 4, "shadow_points": "members", **settings}))


def tents(hierarchy, level, rows):
    """Trilinear weight (m, r) of source lights `rows` at each vertex of `level`, and their merged indices."""
    size = float(hierarchy.cell_size[level])
    u = np.clip(
        (hierarchy.position[rows].astype(np.float64) - hierarchy.origin) / size, 0, 2 ** (hierarchy.top - level)
    )
    apart = np.abs(u[None] - hierarchy.levels[level].vertex[:, None].astype(np.float64))
    return np.prod(np.maximum(0, 1 - apart), axis=2)


def source_level(level, settings):
    """The level whose lights those of `level` are made of."""
    if level == 1:
        return 0
    gathered = settings.get("construction") != "scatter"
    return 1 if gathered and settings.get("gather_range") == "half_open" else min(level - 1, 2)


def rows_of(hierarchy, level):
    return slice(int(hierarchy.offset[level]), int(hierarchy.offset[level + 1]))


def shares_by_lights(hierarchy, level, source, settings):
    """Shares (m, r) of the lights of level `source` in the vertices of `level`: weight times luminance."""
    rows = rows_of(hierarchy, source)
    weight = tents(hierarchy, level, rows)
    if source == 1 and settings.get("gather_range") == "half_open":
        stride = 2 ** (level - 1)
        end = (hierarchy.levels[level].vertex.astype(int) + 1) * stride
        weight = weight * np.all(hierarchy.vertex[rows].astype(int)[None] < end[:, None], axis=2)
    share = weight * luminance(hierarchy.flux[rows])
    return share / share.sum(axis=1, keepdims=True)


def expected(hierarchy, level, settings):
    """Shares (m, r) of the vertices of `level` in the lights of the level they are made of, and the first of those."""
    source = source_level(level, settings)
    if source >= (1 if settings.get("construction") == "scatter" else 2):
        reach = 2 ** (level - source)
        apart = np.abs(
            hierarchy.levels[source].vertex.astype(int) - reach * hierarchy.levels[level].vertex[:, None].astype(int)
        )
        share = np.prod(np.maximum(0, 1 - apart / reach), axis=2) * luminance(hierarchy.levels[source].flux)
        return share / share.sum(axis=1, keepdims=True), rows_of(hierarchy, source).start
    return shares_by_lights(hierarchy, level, source, settings), rows_of(hierarchy, source).start


def row(members, i):
    """The members of a row, and the share of each that its alias table amounts to."""
    own, other, keep = members.slot[int(members.offset[i]) : int(members.offset[i + 1])].T
    kept = keep / 2**32
    share = kept + [(1 - kept)[other == light].sum() for light in own]
    return own.astype(int), share / len(own)


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
@pytest.mark.parametrize("name", ["oriented", "with_black", "on_faces", "without_normals", "tiny_scene"])
def test_shares_are_weight_times_luminance(name, settings):
    hierarchy = build(cases.CLOUDS[name](), **settings)
    n, members = len(hierarchy.input_index), hierarchy.members
    compared = 0
    for level in range(1, hierarchy.top + 1):
        want, first = expected(hierarchy, level, settings)
        bright = luminance(hierarchy.levels[level].flux) > 1e-5 * luminance(hierarchy.flux).max()
        for i in np.flatnonzero(bright):
            light, drawn = row(members, int(hierarchy.offset[level]) - n + i)
            share = np.zeros(want.shape[1])
            np.add.at(share, light - first, drawn)
            np.testing.assert_allclose(share, want[i], atol=2e-4)
            assert np.abs(share - want[i]).sum() < 1e-2
            compared += 1
    assert compared > 100


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
@pytest.mark.parametrize("name", ["oriented", "on_faces", "without_normals"])
def test_draws_level_by_level_come_down_to_weight_times_luminance(name, settings):
    """Of S1's lights in each gathered vertex; of input lights where every level is scattered."""
    hierarchy = build(cases.CLOUDS[name](), **settings)
    n, members = len(hierarchy.input_index), hierarchy.members
    base = 0 if settings.get("construction") == "scatter" else 1
    first, end = int(hierarchy.offset[base]), int(hierarchy.offset[base + 1])
    down = np.zeros((len(hierarchy.position), end - first))
    down[first:end] = np.eye(end - first)
    for i in range(end, len(hierarchy.position)):
        light, share = row(members, i - n)
        down[i] = share @ down[light]
    for level in range(base + 1, hierarchy.top + 1):
        want = shares_by_lights(hierarchy, level, base, settings)
        bright = luminance(hierarchy.levels[level].flux) > 1e-5 * luminance(hierarchy.flux).max()
        np.testing.assert_allclose(down[rows_of(hierarchy, level)][bright], want[bright], atol=2e-4)


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
def test_rows_are_well_formed(lights, settings):
    hierarchy = build(lights(), **settings)
    n, members = len(hierarchy.input_index), hierarchy.members
    assert len(members.offset) == len(hierarchy.position) - n + 1 and members.offset[0] == 0
    assert members.offset[-1] == len(members.slot)
    for i in range(len(members.offset) - 1):
        light, share = row(members, i)
        assert len(light) >= 1 and (share >= 0).all() and share.sum() == pytest.approx(1, abs=1e-9)
        level = int(np.searchsorted(hierarchy.offset, i + n, side="right")) - 1
        source = rows_of(hierarchy, source_level(level, settings))
        assert source.start <= light.min() and light.max() < source.stop, "members come from the level it is made of"
        assert len(set(light.tolist())) == len(light)


def test_black_lights_are_never_drawn():
    """A member without light has no share: not of its own slot, and nobody's other light."""
    hierarchy = build(cases.with_black())
    black = ~np.any(hierarchy.flux > 0, axis=1)
    n = len(hierarchy.input_index)
    drawn = 0.0
    for i in range(int(hierarchy.offset[2]) - n):
        light, share = row(hierarchy.members, i)
        drawn += share[black[light]].sum()
    assert black.any() and drawn == 0


@pytest.mark.parametrize("settings, there", [
    ({}, True), ({"shadow_samples": 0}, False), ({"shadow_points": "jitter"}, False),
])  # fmt: skip
def test_members_are_built_where_they_will_be_drawn_from(settings, there):
    assert (build(cases.cloud(50), **settings).members is not None) == there


def test_members_do_not_change_the_hierarchy():
    lights = cases.mixed_cloud()
    one, other = build(lights), build(lights, shadow_samples=0)
    for name in ("position", "flux", "normal", "deviation", "vertex", "offset"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
