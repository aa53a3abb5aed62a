"""What a grid light is made of: the input lights that its shadow points are drawn from (LY19 3.3)."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lab import _core
from lab.engine.cpu import build_members
from lab.errors import LabError
from lab.params import Params
from lab.records import Hierarchy

_built: dict[int, tuple[weakref.ref[Hierarchy], Hierarchy]] = {}


def member_shares(
    hierarchy: Hierarchy, index: int, params: Params | None = None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The input lights that grid light `index` is made of, and the probability that a shadow point is drawn from each.

    A light's probability goes with its trilinear weight in the grid light times its luminance; light for light it is
    what the stages draw with, the resolution of its tables included.

    Args:
        hierarchy: any; where it has no member lists they are built once, and kept as long as it lives.
        index: merged index. An input light is its own only member.
        params: those the hierarchy was built with; only looked at where member lists are missing.

    Returns:
        (j,) ascending merged indices of input lights, and their (j,) probabilities, which sum to 1.
    """
    if int(index) != index or not 0 <= index < len(hierarchy.position):
        raise LabError(f"light {index}: merged indices go from 0 to {len(hierarchy.position) - 1}")
    member, share = _core.member_shares(with_members(hierarchy, params), int(index))
    return member.astype(np.int64), share


def with_members(hierarchy: Hierarchy, params: Params | None = None) -> Hierarchy:
    """`hierarchy` with its member lists, which are built where it has none."""
    if hierarchy.members is not None:
        return hierarchy
    key = id(hierarchy)
    kept = _built.get(key)
    if kept is None or kept[0]() is not hierarchy:
        whole = replace(hierarchy, members=build_members(hierarchy, params or Params()))
        kept = weakref.ref(hierarchy, lambda _: _built.pop(key, None)), whole
        _built[key] = kept
    return kept[1]
