"""What grid lights are made of: shares against the trilinear weights, sums and means over them."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest

from lab import _core
from lab.engine.cpu import build_hierarchy
from lab.errors import LabError
from lab.params import Params
from lab.pixel import member_shares, members

from ..oracle_geometry import grids
from ..oracle_geometry.scenes import wall_lights

LIGHTS = wall_lights(5, 300)


@pytest.mark.parametrize("construction", ["gather", "scatter"])
def test_shares_are_trilinear_weight_times_luminance(construction: str) -> None:
    h = build_hierarchy(LIGHTS, Params(levels=4, construction=construction))
    wanted = grids.member_shares(h, construction)
    for index in range(0, len(h.position), 3):
        member, share = member_shares(h, index)
        assert (np.diff(member) > 0).all() and share.sum() == pytest.approx(1)
        found = np.zeros(wanted.shape[1])
        found[member] = share
        np.testing.assert_allclose(found, wanted[index], atol=2e-5)


def test_sums_and_means_go_by_the_shares() -> None:
    h = build_hierarchy(LIGHTS, Params(levels=4))
    m, n = len(h.position), len(h.input_index)
    whole = np.zeros((m, n))
    for index in range(m):
        member, share = member_shares(h, index)
        whole[index, member] = share
    rng = np.random.default_rng(0)
    values, weight = rng.uniform(size=(n, 3)), rng.uniform(size=m) * (rng.random(m) < 0.3)
    np.testing.assert_allclose(_core.member_means(h, values), whole @ values, rtol=1e-9)
    np.testing.assert_allclose(_core.member_sums(h, weight), weight @ whole, rtol=1e-9, atol=1e-12)


def test_members_are_built_once_where_there_are_none() -> None:
    params = Params(levels=4, gather_range="half_open", shadow_samples=0)
    bare = build_hierarchy(LIGHTS, params)
    drawn = build_hierarchy(LIGHTS, params.replace(shadow_samples=1))
    assert bare.members is None and drawn.members is not None
    top = len(bare.position) - 1
    for mine, theirs in zip(member_shares(bare, top, params), member_shares(drawn, top), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert members.with_members(bare) is members.with_members(bare)
    assert members.with_members(drawn) is drawn
    kept = len(members._built)
    del bare
    gc.collect()
    assert len(members._built) == kept - 1, "they go with their hierarchy"


def test_lights_that_do_not_exist() -> None:
    h = build_hierarchy(LIGHTS, Params(levels=2))
    for index in (-1, len(h.position), 0.5):
        with pytest.raises(LabError, match=f"go from 0 to {len(h.position) - 1}"):
            member_shares(h, index)
    with pytest.raises(ValueError, match="without members"):
        _core.member_means(replace(h, members=None), np.zeros((len(LIGHTS), 1)))
    with pytest.raises(TypeError, match="row for each"):
        _core.member_means(h, np.zeros((len(LIGHTS) + 1, 1)))
    with pytest.raises(ValueError, match="no such light"):
        _core.member_shares(h, len(h.position))
