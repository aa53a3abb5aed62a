"""A hierarchy on the device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.layouts import GRID_LIGHT, HIERARCHY_INFO
from lab.engine.vulkan.members import MemberParts, upload_members
from lab.engine.vulkan.records import device_record, parts
from lab.errors import LabError
from lab.records import Floats, Hierarchy, Members

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

_MOMENTS = ("moment_xx", "moment_yy", "moment_zz", "moment_xy", "moment_xz", "moment_yz")


@dataclass(frozen=True)
class HierarchyParts:
    """The buffers of a hierarchy. How many rows of `lights` are used only the device knows: ``info[0].offset``.

    Attributes:
        info: one row of ``HierarchyInfo``.    lights: rows of ``GridLight``, all levels merged; the last are unused.
        input_index: (n,) uint32, row of the input list that merged index i < n came from.
        most_levels: no more than these, level 0 included; known without reading anything back.
        members: what grid lights are made of, where shadow points are drawn from that.

    """

    info: DeviceBuffer
    lights: DeviceBuffer
    input_index: DeviceBuffer
    most_levels: int
    members: MemberParts | None = None

    @cached_property
    def on_host(self) -> NDArray[Any]:
        """The row of `info`, read back when it is first asked for; a :class:`LabError` where lights were left out."""
        row: NDArray[Any] = self.info.numpy()[0]
        if row["overflow"]:
            raise LabError(
                f"the hierarchy has more than the {len(self.lights)} lights that there is room for: this set of lights "
                "is too scattered for the Vulkan engine. Use fewer levels, or --engine cpu"
            )
        return row

    def levels(self) -> int:
        """How many there are, level 0 included; read back."""
        return int(self.on_host["top"]) + 1

    @cached_property
    def rows(self) -> NDArray[Any]:
        """The used rows of `lights`, read back."""
        return self.lights.numpy(int(self.on_host["offset"][self.on_host["top"] + 1]))


def hierarchy_parts(gpu: Gpu, hierarchy: Hierarchy, *, members: bool = False) -> HierarchyParts:
    """The device's buffers of any hierarchy; one of the host is uploaded, with its `members` if they are asked for."""
    own = parts(hierarchy)
    if isinstance(own, HierarchyParts):
        return own
    rows = np.zeros(len(hierarchy.position), GRID_LIGHT)
    for name in ("position", "flux", "normal", "deviation"):
        rows[name] = getattr(hierarchy, name)
    for column, name in enumerate(_MOMENTS):
        rows[name] = hierarchy.normal_moment[:, column]
    vertex = hierarchy.vertex.astype(np.uint32)
    rows["vertex_xy"] = vertex[:, 0] | vertex[:, 1] << 16
    rows["vertex_z_oriented"] = vertex[:, 2] | hierarchy.oriented.astype(np.uint32) << 16
    info = np.zeros(1, HIERARCHY_INFO)
    levels = hierarchy.top + 1
    info["origin"], info["top_size"] = hierarchy.origin, hierarchy.cell_size[-1]
    info["top"], info["inputs"], info["flux_scale"] = hierarchy.top, len(hierarchy.input_index), 1
    info["offset"][0, : levels + 1] = hierarchy.offset
    info["offset"][0, levels + 1 :] = hierarchy.offset[-1]
    info["cell_size"][0, :levels] = hierarchy.cell_size
    pool = gpu.pool
    return HierarchyParts(
        pool.upload(info, "hierarchy info"),
        pool.upload(rows, "grid lights"),
        pool.upload(hierarchy.input_index, "input index"),
        levels,
        upload_members(gpu, hierarchy.members) if members and hierarchy.members else None,
    )


def device_hierarchy(made: HierarchyParts) -> Hierarchy:
    """The record of a hierarchy that shaders made."""

    def column(name: str) -> Callable[[], Floats]:
        return lambda: np.ascontiguousarray(made.rows[name])

    def about(pick: Callable[[NDArray[Any]], NDArray[Any]]) -> Callable[[], NDArray[Any]]:
        return lambda: pick(made.on_host).copy()

    def members() -> Members | None:
        if made.members is None:
            return None
        return made.members.numpy(len(made.rows) - len(made.input_index))

    def vertex() -> NDArray[np.uint16]:
        xy, z = made.rows["vertex_xy"], made.rows["vertex_z_oriented"]
        return np.stack([xy & 0xFFFF, xy >> 16, z & 0xFFFF], axis=1).astype(np.uint16)

    return device_record(
        Hierarchy,
        made,
        {
            "origin": about(lambda row: row["origin"]),
            "cell_size": about(lambda row: row["cell_size"][: row["top"] + 1]),
            "offset": about(lambda row: row["offset"][: row["top"] + 2].astype(np.int64)),
            **{name: column(name) for name in ("position", "flux", "normal", "deviation")},
            "normal_moment": lambda: np.stack([made.rows[name] for name in _MOMENTS], axis=1),
            "vertex": vertex,
            "oriented": lambda: (made.rows["vertex_z_oriented"] >> 16).astype(np.uint8),
            "input_index": made.input_index.numpy,
            "members": members,
        },
    )
