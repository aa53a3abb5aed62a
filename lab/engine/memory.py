"""Says no before a frame would not fit into memory: a clear error beats a killed process."""

from __future__ import annotations

from pathlib import Path

from lab.errors import LabError
from lab.params import Params

# Measured on frames of 1K..1M VPLs and 0.06..0.9 million pixels, rounded up.
_BYTES_PER_LIGHT = 450
_BYTES_PER_PIXEL, _BYTES_PER_SHADOW_SAMPLE = 320, 40


def available_bytes() -> int | None:
    """Memory that could be had now, within the limit of a container too; None where the system does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        values = dict(line.split(":", 1) for line in lines)
        available = int(values["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError):
        return None
    try:
        group = Path("/sys/fs/cgroup")
        limit, used = ((group / name).read_text(encoding="ascii").strip() for name in ("memory.max", "memory.current"))
        return available if limit == "max" else min(available, int(limit) - int(used))
    except (OSError, ValueError):
        return available


def check_memory(lights: int, size: tuple[int, int], params: Params) -> None:
    """Raises :class:`LabError` where so many lights and `size` = (width, height) pixels need more than there is."""
    per_pixel = _BYTES_PER_PIXEL + _BYTES_PER_SHADOW_SAMPLE * params.shadow_samples
    needs = {
        f"{lights:,} lights (fewer: --set vpls=...)": lights * _BYTES_PER_LIGHT,
        f"{size[0]}x{size[1]} pixels with {params.shadow_samples} shadow samples each (smaller: --size)": (
            size[0] * size[1] * per_pixel
        ),
    }
    refuse_unless_it_fits("frame", needs)


def refuse_unless_it_fits(work: str, needs: dict[str, int]) -> None:
    """Raises :class:`LabError` where the bytes that this `work` needs, by what needs them, are more than there are."""
    available = available_bytes()
    if available is not None:
        from lab import _core

        available += _core.buffer_bytes()["kept"]  # ours already, for this very use
    if available is not None and sum(needs.values()) > available:
        what, most = max(needs.items(), key=lambda item: item[1])
        raise LabError(
            f"this {work} needs about {sum(needs.values()) / 1e9:.0f} GB of memory, {available / 1e9:.0f} GB are free; "
            f"{most / 1e9:.0f} GB of it for {what}"
        )
