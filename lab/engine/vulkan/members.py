"""Member lists of grid lights on the device, for drawing shadow points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.errors import LabError
from lab.records import Members

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

SLOT_BYTES = 12
MOST_SLOTS = (2**32 - 1) // SLOT_BYTES
"""What shaders can address."""


@dataclass(frozen=True)
class MemberParts:
    """The buffers of member lists.

    Attributes:
        list: 2u4, of each light of level 1 and up: its first slot, and how many it has.
        slot: 3u4, as those of :class:`~lab.records.Members`, but list after list in any order.

    """

    list: DeviceBuffer
    slot: DeviceBuffer

    @property
    def uniform(self) -> dict[str, DeviceBuffer]:
        """The value of a shader's ``MemberBuffers``."""
        return {"list": self.list, "slot": self.slot}

    def numpy(self, rows: int) -> Members:
        """The first `rows` lists, read back, with their slots in order."""
        first, count = self.list.numpy(rows).astype(np.int64).T
        offset = np.concatenate([np.zeros(1, np.int64), np.cumsum(count)])
        slots = self.slot.numpy(int((first + count).max(initial=0)))
        return Members(offset, slots[np.repeat(first - offset[:-1], count) + np.arange(offset[-1])])


def upload_members(gpu: Gpu, members: Members) -> MemberParts:
    """Member lists of the host, on the device.

    Errors: :class:`LabError` for more slots than it can address.
    """
    if len(members.slot) > MOST_SLOTS:
        raise LabError(f"the member lists have {len(members.slot):,} slots: the Vulkan engine takes {MOST_SLOTS:,}")
    rows = np.stack([members.offset[:-1], np.diff(members.offset)], axis=1).astype(np.uint32)
    return MemberParts(gpu.pool.upload(rows, "member lists"), gpu.pool.upload(members.slot, "member slots"))


def no_members(gpu: Gpu) -> MemberParts:
    """What is bound where nothing is drawn."""
    return upload_members(gpu, Members(np.zeros(1, np.int64), np.zeros((0, 3), np.uint32)))
