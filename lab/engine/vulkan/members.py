"""Member lists of grid lights on the device, for drawing shadow points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from lab.engine.vulkan.hierarchy import HierarchyParts
from lab.engine.vulkan.records import parts
from lab.errors import LabError
from lab.params import Params
from lab.records import Hierarchy, Members

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

Uniform = dict[str, Any]


class MemberTables:
    """The lists of hierarchies, kept as long as these are.

    A hierarchy that was built on the device brings none: its levels are read back then, and the core makes them.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._kept: WeakKeyDictionary[HierarchyParts, Uniform] = WeakKeyDictionary()
        self._none = self._upload(Members(np.zeros(1, np.int64), np.zeros((0, 3), np.uint32)))

    def uniform(self, hierarchy: Hierarchy, params: Params, *, drawn: bool) -> Uniform:
        """The value of a shader's ``MemberBuffers``; empty lists where nothing is `drawn` from them."""
        if not drawn:
            return self._none
        own = parts(hierarchy)
        if not isinstance(own, HierarchyParts):
            if hierarchy.members is None:
                raise LabError("this hierarchy has no member lists: build it with shadow_points=members")
            return self._upload(hierarchy.members)
        if own not in self._kept:
            self._kept[own] = self._upload(_made_by_core(hierarchy, params))
        return self._kept[own]

    def _upload(self, members: Members) -> Uniform:
        if len(members.slot) >= 2**32:
            raise LabError(f"the member lists have {len(members.slot):,} entries: the Vulkan engine takes 2^32")
        return {
            "offset": self._gpu.pool.upload(members.offset.astype(np.uint32), "member offsets"),
            "slot": self._gpu.pool.upload(members.slot, "member slots"),
        }


def _made_by_core(hierarchy: Hierarchy, params: Params) -> Members:
    from lab import _core

    return Members(**_core.build_members(hierarchy, params.to_core()))
