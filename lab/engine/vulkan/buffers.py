"""Memory on the device: typed buffers, from a pool that they go back to by themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lab.engine.vulkan.adapters import import_slangpy

if TYPE_CHECKING:
    import slangpy as spy

_SMALLEST = 256


class DeviceBuffer:
    """Rows of one type in device memory. Nothing comes to the host but by :meth:`numpy`.

    Work is done in the order in which it is handed to the device: a buffer that nobody holds any more may be taken
    for the next stage while the last one still reads it.

    Attributes:
        dtype: of one row; structured where the shader's type is a struct, with a sub-array (``"4f4"``) for a vector.
        rows: how many.    label: what it holds, for messages.    raw: slangpy's buffer, maybe larger.

    """

    def __init__(self, pool: BufferPool, raw: spy.Buffer, rows: int, dtype: np.dtype[Any], label: str) -> None:
        self._pool, self.raw = pool, raw
        self.rows, self.dtype, self.label = rows, dtype, label

    def __len__(self) -> int:
        return self.rows

    @property
    def nbytes(self) -> int:
        """Bytes of its rows."""
        return self.rows * self.dtype.itemsize

    def numpy(self, rows: int | None = None) -> NDArray[Any]:
        """A copy of its first `rows` (all), once all work that was handed to the device before is done."""
        count = self.rows if rows is None else rows
        if not 0 <= count <= self.rows:
            raise ValueError(f"{self.label}: {count} rows asked for, it has {self.rows}")
        data = self._pool.download(self.raw, count * self.dtype.itemsize)
        base, shape = self.dtype.subdtype or (self.dtype, ())
        return data.view(base).reshape(count, *shape)

    def upload(self, values: NDArray[Any]) -> None:
        """Fills it from its first row on; `values` must be of its type and have no more rows."""
        base, shape = self.dtype.subdtype or (self.dtype, ())
        if values.dtype != base or values.shape[1:] != shape or len(values) > self.rows:
            raise ValueError(
                f"{self.label}: holds {self.rows} rows of {self.dtype}, got {values.dtype} of shape {values.shape}"
            )
        if values.size:
            self.raw.copy_from_numpy(np.ascontiguousarray(values).reshape(-1).view(np.uint8))

    def __del__(self) -> None:
        self._pool.give_back(self.raw)


class BufferPool:
    """Device memory in blocks that are used again, frame after frame."""

    def __init__(self, device: spy.Device) -> None:
        self._device = device
        self._free: dict[int, list[spy.Buffer]] = {}
        self._closed = False
        self.in_use = 0
        self.allocated = 0

    def take(self, rows: int, dtype: DTypeLike, label: str) -> DeviceBuffer:
        """A buffer of `rows` rows; what is in it is left from before. Every kind of shader access is allowed."""
        kind = np.dtype(dtype)
        size = _block(rows * kind.itemsize)
        free = self._free.setdefault(size, [])
        raw = free.pop() if free else self._allocate(size)
        self.in_use += size
        return DeviceBuffer(self, raw, rows, kind, label)

    def upload(self, values: NDArray[Any], label: str) -> DeviceBuffer:
        """A new buffer with `values`: rows are along the first axis, what is left of the shape is one row's."""
        kind = np.dtype((values.dtype, values.shape[1:])) if values.ndim > 1 else values.dtype
        buffer = self.take(len(values), kind, label)
        buffer.upload(values)
        return buffer

    def give_back(self, raw: spy.Buffer) -> None:
        """`raw` may be taken again."""
        self.in_use -= raw.size
        if not self._closed:
            self._free[raw.size].append(raw)

    def trim(self) -> None:
        """Gives the memory of all free blocks back to the driver."""
        for free in self._free.values():
            self.allocated -= sum(raw.size for raw in free)
            free.clear()

    def close(self) -> None:
        """Keeps nothing any more."""
        self.trim()
        self._closed = True

    def download(self, raw: spy.Buffer, nbytes: int) -> NDArray[np.uint8]:
        """The first bytes of a buffer."""
        if nbytes == 0:
            return np.zeros(0, np.uint8)
        if 2 * nbytes < raw.size:
            # slangpy copies whole buffers only.
            part = self._device.create_buffer(size=nbytes, usage=_usage())
            encoder = self._device.create_command_encoder()
            encoder.copy_buffer(part, 0, raw, 0, nbytes)
            self._device.submit_command_buffer(encoder.finish())
            raw = part
        whole: NDArray[Any] = raw.to_numpy()
        return whole.view(np.uint8).reshape(-1)[:nbytes].copy()

    def _allocate(self, size: int) -> spy.Buffer:
        self.allocated += size
        return self._device.create_buffer(size=size, usage=_usage())


def _usage() -> Any:
    usage = import_slangpy().BufferUsage
    return (
        usage.shader_resource
        | usage.unordered_access
        | usage.copy_source
        | usage.copy_destination
        | usage.indirect_argument
        | usage.acceleration_structure_build_input
    )


def _block(size: int) -> int:
    """Bytes rounded up to steps of an eighth: sizes that change a little find the same blocks."""
    step = max(_SMALLEST, 1 << max(0, size.bit_length() - 4))
    return max(_SMALLEST, -(-size // step) * step)
