"""How much room a hierarchy may take, known before the device has counted anything."""

from __future__ import annotations

from dataclasses import dataclass

from lab.errors import LabError
from lab.params import Params

COLUMNS = 24
"""Numbers that a vertex accumulates: shaders/lib/vertex_sums.slang."""

MOST_LEVELS = 10
"""Vertices are kept as bits of the whole grid: eleven levels would take 135 MB, twelve over a gigabyte."""

MOST_LIGHTS = 8_000_000
"""So that no buffer comes near the 4 GB that shaders can address."""

LIGHTS_OF_GROUP = 32
"""Eight threads a light, 256 to a group."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of a build's buffers.

    Attributes:
        inputs: lights.    most: S1 must have fewer vertices than this, where the number of levels is chosen.
        first_candidate, last_candidate: numbers of levels that are tried. The first can't fail.
        half: words of the vertices of all levels.    capacity: rows of the merged lights.
        sum_rows: the most vertices of a level.    coarse_rows: of the levels from 2 up.
        key_bits: of a cell of level 1.

    """

    inputs: int
    most: int
    first_candidate: int
    last_candidate: int
    half: int
    capacity: int
    sum_rows: int
    coarse_rows: int
    key_bits: int


def hierarchy_sizes(count: int, params: Params, most_groups: int = 65535) -> Sizes:
    """Room for `count` lights, or a :class:`LabError` where that is too much for the device.

    `most_groups`: groups of threads that it runs at once.
    """
    most_lights = min(MOST_LIGHTS, most_groups * LIGHTS_OF_GROUP)
    if count > most_lights:
        raise LabError(f"{count} lights: this device takes at most {most_lights}; use --engine cpu for more")
    most = (count + 1) // 2
    if params.levels == "auto":
        fixed = None
        # As long as the whole grid has fewer vertices, S1 has.
        first = max(levels for levels in range(1, MOST_LEVELS + 1) if levels == 1 or _side(levels, 1) ** 3 < most)
        last, largest = MOST_LEVELS, max(most, 8)
    else:
        fixed = _demo_levels(count) if params.levels == "demo" else int(params.levels)
        if fixed > MOST_LEVELS:
            raise LabError(
                f"levels={params.levels} ({fixed} levels): the Vulkan engine builds at most {MOST_LEVELS}; use fewer, "
                "or --engine cpu"
            )
        first = last = fixed
        largest = 8 * count
    kept = [min(_side(last, level) ** 3, largest) for level in range(1, last + 1)]
    return Sizes(
        inputs=count,
        most=most,
        first_candidate=first,
        last_candidate=last,
        half=sum(_words(last, level) for level in range(1, last + 1)),
        capacity=count + sum(kept),
        sum_rows=max(kept),
        coarse_rows=sum(kept[1:]),
        key_bits=max(1, 3 * (last - 1)),
    )


def _side(levels: int, level: int) -> int:
    return (1 << (levels - level)) + 1


def _words(levels: int, level: int) -> int:
    side = _side(levels, level)
    return side * side * -(-side // 32)


def _demo_levels(count: int) -> int:
    """Smallest H with 8^H > 10 N."""
    levels = 1
    while levels < 12 and 8**levels <= 10 * count:
        levels += 1
    return levels
