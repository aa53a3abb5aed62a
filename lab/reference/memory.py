"""Says no before a reference would not fit into memory."""

from __future__ import annotations

from lab.engine.memory import refuse_unless_it_fits

# Measured at 0.06..0.9 million pixels and 1K..1M lights, rounded up. Sums are float64, and new ones are made beside the
# old, so that an interrupted step leaves them whole.
_BYTES_PER_PIXEL, _BYTES_PER_LIGHT = 900, 600


def check_memory(size: tuple[int, int], lights: int) -> None:
    """Raises :class:`LabError` where (width, height) pixels and so many virtual lights need more than there is."""
    needs = {
        f"{size[0]}x{size[1]} pixels (smaller: --size)": size[0] * size[1] * _BYTES_PER_PIXEL,
        f"{lights:,} lights (fewer: --set vpls=...)": lights * _BYTES_PER_LIGHT,
    }
    refuse_unless_it_fits("reference", needs)
