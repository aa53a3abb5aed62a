"""Mistakes made on purpose, one for each kind of check: layers that do not report them are not listening."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.buffers import BufferPool, DeviceBuffer
from lab.engine.vulkan.device import Gpu
from lab.engine.vulkan.program import ComputeProgram


@dataclass(frozen=True)
class Mistake:
    """What `make` does wrong, and a part of what the layers say of it."""

    name: str
    make: Callable[[Gpu], None]
    message: str


def _wrong_usage(gpu: Gpu) -> None:
    """A buffer that only copies were announced for is written by a shader."""
    raw = gpu.device.create_buffer(size=256, usage=import_slangpy().BufferUsage.copy_source)
    pool = BufferPool(gpu.device)  # its own: nobody else must ever be given this buffer
    _run(gpu, DeviceBuffer(pool, raw, 64, np.dtype("u4"), "rows"), 0)
    pool.close()


def _copy_twice(gpu: Gpu) -> None:
    """Two copies to one place with nothing in between."""
    here, there = (gpu.pool.take(64, "u4", "rows") for _ in range(2))
    encoder = gpu.device.create_command_encoder()
    for _ in range(2):
        encoder.copy_buffer(here.raw, 0, there.raw, 0, here.nbytes)
    gpu.device.submit_command_buffer(encoder.finish())
    gpu.device.wait()


def _write_beyond(gpu: Gpu) -> None:
    _run(gpu, gpu.pool.take(64, "u4", "rows"), 1 << 20)


def _run(gpu: Gpu, rows: DeviceBuffer, row: int) -> None:
    program = ComputeProgram(gpu.device, str(Path(__file__).with_name("mistakes")), "write_beyond", {})
    encoder = gpu.device.create_command_encoder()
    program.dispatch(encoder, [1, 1, 1], rows=rows, row=row)
    gpu.device.submit_command_buffer(encoder.finish())
    gpu.device.wait()


MISTAKES = {
    "core": Mistake("a shader writes a buffer that is not for it", _wrong_usage, "VUID-"),
    "sync": Mistake("two copies to one place", _copy_twice, "SYNC-HAZARD-WRITE-AFTER-WRITE"),
    "gpu": Mistake("a shader that writes beyond a buffer's end", _write_beyond, "VUID"),
}
