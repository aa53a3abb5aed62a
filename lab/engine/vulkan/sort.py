"""A stable radix sort on the device."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lab.engine.vulkan.buffers import DeviceBuffer

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu

_MODULE = "build_hierarchy_sort"
_DIGIT_BITS = 8
_THREADS = 256
_KEYS_OF_GROUP = 1024
_COUNTS_OF_BLOCK = 1024


def sort_keys(gpu: Gpu, encoder: spy.CommandEncoder, keys: DeviceBuffer, bits: int) -> DeviceBuffer:
    """`keys` (rows of key and value, uint32) by the lowest `bits` of their keys, equals in their order."""
    count = len(keys)
    groups = -(-count // _KEYS_OF_GROUP)
    size = groups << _DIGIT_BITS
    blocks = -(-size // _COUNTS_OF_BLOCK)
    counts = gpu.pool.take(size, "u4", "digit counts")
    block_sums = gpu.pool.take(blocks, "u4", "sums of digit counts")
    other = gpu.pool.take(count, "2u4", "sorted keys")
    threads, scanned = [groups * _THREADS, 1, 1], [blocks * _THREADS, 1, 1]
    for shift in range(0, bits, _DIGIT_BITS):
        of_keys = {"count": count, "groups": groups, "shift": shift}
        gpu.program(_MODULE, "count_digits").dispatch(encoder, threads, keys=keys, counts=counts, **of_keys)
        of_counts = {"counts": counts, "size": size, "block_sums": block_sums}
        gpu.program(_MODULE, "sum_counts").dispatch(encoder, scanned, **of_counts)
        gpu.program(_MODULE, "scan_sums").dispatch(encoder, [_THREADS, 1, 1], block_sums=block_sums, blocks=blocks)
        gpu.program(_MODULE, "scan_counts").dispatch(encoder, scanned, **of_counts)
        gpu.program(_MODULE, "move_keys").dispatch(encoder, threads, keys=keys, first=counts, sorted=other, **of_keys)
        keys, other = other, keys
    return keys
