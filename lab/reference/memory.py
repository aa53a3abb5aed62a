"""Says no before a reference would not fit into memory."""

from __future__ import annotations

from lab.engine.memory import available_bytes
from lab.errors import LabError

# Measured at 0.06..0.9 million pixels and 1K..1M lights, rounded up. Sums are float64, and new ones are made beside the
# old, so that an interrupted step leaves them whole.
_BYTES_PER_PIXEL, _BYTES_PER_LIGHT = 900, 600


def check_memory(size: tuple[int, int], lights: int) -> None:
    """Raises :class:`LabError` where (width, height) pixels and so many virtual lights need more than there is."""
    available = available_bytes()
    if available is None:
        return
    needs = {
        f"{size[0]}x{size[1]} pixels (smaller: --size)": size[0] * size[1] * _BYTES_PER_PIXEL,
        f"{lights:,} lights (fewer: --set vpls=...)": lights * _BYTES_PER_LIGHT,
    }
    if sum(needs.values()) > available:
        what, most = max(needs.items(), key=lambda item: item[1])
        raise LabError(
            f"this reference needs about {sum(needs.values()) / 1e9:.0f} GB of memory, {available / 1e9:.0f} GB are "
            f"free; {most / 1e9:.0f} GB of it for {what}"
        )
