"""Member lists that the device makes: the core's own, slot by slot, and draws that follow them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lab.engine.cpu import build_members
from lab.engine.vulkan.build_hierarchy import build_hierarchy
from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.hierarchy import hierarchy_parts
from lab.engine.vulkan.records import parts
from lab.errors import LabError
from lab.params import Params
from lab.records import Hierarchy, Lights, Members

from ..oracle_geometry.grids import member_shares
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.statistics import accept, chi_square
from .test_vulkan_build_hierarchy import SETS, walls

SETTINGS: list[dict[str, Any]] = [
    {"levels": 1},
    {"levels": 2},
    {"levels": 7},
    {"levels": "demo"},
    {"construction": "scatter"},
    {"construction": "scatter", "levels": 6},
    {"gather_range": "half_open"},
    {"gather_range": "half_open", "levels": 6},
    {"centre_weight": "count", "bounds_scale": 1.1},
]


def assert_same(found: Members, wanted: Members) -> None:
    """The same lists and tables. Where a division is not rounded right, shares differ in their last digits."""
    np.testing.assert_array_equal(found.offset, wanted.offset)
    assert found.offset.dtype == wanted.offset.dtype and found.slot.dtype == wanted.slot.dtype
    np.testing.assert_array_equal(found.slot[:, 0], wanted.slot[:, 0])
    same = found.slot[:, 1] == wanted.slot[:, 1]
    assert (~same).sum() <= 1e-4 * len(same)
    apart = found.slot[:, 2].astype(np.int64) - wanted.slot[:, 2]
    assert np.abs(apart[same]).max(initial=0) < 2**12


def members_of(hierarchy: Hierarchy) -> Members:
    assert hierarchy.members is not None
    return hierarchy.members


@pytest.mark.parametrize("lights", [*SETS.values(), walls(20_000, 3)], ids=[*SETS, "twenty thousand"])
def test_lists_are_those_of_the_core(gpu: Any, lights: Lights) -> None:
    made = build_hierarchy(gpu, lights, Params())
    assert_same(members_of(made), build_members(made, Params()))


@pytest.mark.parametrize("change", SETTINGS, ids=str)
def test_every_setting_is_that_of_the_core(gpu: Any, change: dict[str, Any]) -> None:
    params = Params(**change)
    made = build_hierarchy(gpu, walls(1500, 3), params)
    assert_same(members_of(made), build_members(made, params))
    lists = np.diff(members_of(made).offset)
    if change.get("levels") in (1, 7):
        assert lists.max() > 512, "made by a group of threads, several members each"


@given(
    seed=st.integers(0, 2**31),
    count=st.integers(1, 120),
    levels=st.integers(1, 5),
    places=st.integers(1, 40),
    black=st.floats(0, 1),
    construction=st.sampled_from(["gather", "scatter"]),
    gather_range=st.sampled_from(["inclusive", "half_open"]),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_lights(
    gpu: Any, seed: int, count: int, levels: int, places: int, black: float, construction: str, gather_range: str
) -> None:
    """Many in one place, on faces of the grid, without flux, without normals, of any brightness."""
    rng = np.random.default_rng(seed)
    corners = rng.integers(0, 9, (places, 3)) / 8
    position = np.where(rng.random((count, 1)) < 0.5, corners[rng.integers(0, places, count)], rng.random((count, 3)))
    flux = rng.random((count, 3)) * 10 ** rng.uniform(-12, 3, (count, 1)) * (rng.random((count, 1)) >= black)
    normal = np.where(rng.random((count, 1)) < 0.5, [0.0, 0.6, 0.8], 0.0)
    params = Params(levels=levels, construction=construction, gather_range=gather_range)
    made = build_hierarchy(gpu, Lights(position, flux, normal), params)
    assert_same(members_of(made), build_members(made, params))


def test_lists_are_made_where_they_will_be_drawn_from(gpu: Any) -> None:
    lights = walls(40)
    for change in ({"shadow_samples": 0}, {"shadow_points": "jitter"}):
        made = build_hierarchy(gpu, lights, Params(**change))
        assert parts(made).members is None and made.members is None
    made = build_hierarchy(gpu, lights, Params())
    assert parts(made).members is not None
    assert hierarchy_parts(gpu, made, members=True) is parts(made)


def test_lists_of_the_host_come_back_as_they_were(gpu: Any) -> None:
    made = build_hierarchy(gpu, walls(300), Params())
    host = dataclasses.replace(made)
    uploaded = hierarchy_parts(gpu, host, members=True).members
    assert uploaded is not None and hierarchy_parts(gpu, host).members is None
    found, wanted = uploaded.numpy(len(members_of(host).offset) - 1), members_of(host)
    np.testing.assert_array_equal(found.offset, wanted.offset)
    np.testing.assert_array_equal(found.slot, wanted.slot)


@pytest.mark.parametrize("construction", ["gather", "scatter"])
def test_members_are_drawn_by_weight_times_luminance(gpu: Any, construction: str) -> None:
    lights = wall_lights(3, 60)
    params = Params(construction=construction, levels=3, shadow_samples=4, member_candidates=1, seed=1)
    engine = VulkanEngine(occluded_room(lights), gpu)
    hierarchy = engine.build_hierarchy(lights, params)
    rows = np.unique(np.linspace(hierarchy.offset[1], hierarchy.offset[-1] - 1, 12).astype(np.int32))
    shape = (500, len(rows))
    points = points_as_gbuffer(np.tile([0.8, 0.0, -0.2], (*shape, 1)), np.tile([0.0, 1.0, 0.0], (*shape, 1)))
    picked = dataclasses.replace(
        engine.light(hierarchy, points, params, counts=False),
        light=np.ascontiguousarray(np.tile(rows[None, :, None], (shape[0], 1, 4))),
        target_weight=np.ones((*shape, 4), np.float32),
        weight_sum=np.ones(shape, np.float32),
    )
    member = engine.trace_shadow_rays(hierarchy, points, picked, params).member
    counts = [np.bincount(member[:, i].ravel(), minlength=len(lights)) for i in range(len(rows))]
    share = member_shares(hierarchy, construction)[rows]
    assert accept([chi_square(c, p) for c, p in zip(counts, share, strict=True)])
    even = [(p > 0).astype(float) for p in share]
    assert not accept([chi_square(c, p) for c, p in zip(counts, even, strict=True)]), "evenly"


def test_a_hierarchy_without_lists_is_not_drawn_from(gpu: Any) -> None:
    lights, params = wall_lights(3, 60), Params(shadow_points="jitter")
    engine = VulkanEngine(occluded_room(lights), gpu)
    hierarchy = engine.build_hierarchy(lights, params)
    points = points_as_gbuffer(np.zeros((2, 2, 3)), np.tile([0.0, 1.0, 0.0], (2, 2, 1)))
    lighting = engine.light(hierarchy, points, params)
    with pytest.raises(LabError, match="this hierarchy has no member lists: build it with shadow_points=members"):
        engine.trace_shadow_rays(hierarchy, points, lighting, Params())
