"""How much room a hierarchy may take, known before the device has counted anything."""

from __future__ import annotations

from dataclasses import dataclass

from lab.engine.dependencies import draws_members
from lab.engine.vulkan.layouts import GRID_LIGHT
from lab.engine.vulkan.members import MOST_SLOTS
from lab.errors import LabError
from lab.params import Params

COLUMNS = 24
"""Numbers that a vertex accumulates: shaders/lib/vertex_sums.slang."""

MOST_LEVELS = 10
"""Vertices are kept as bits of the whole grid: eleven levels would take 135 MB, twelve over a gigabyte."""

MOST_LIGHTS = 8_000_000
"""So that no buffer comes near the 4 GB that shaders can address."""

MOST_GROUPS = 65535
"""Of threads, in one dispatch: every device has as many."""

_MOST_ROWS = MOST_GROUPS * 256
_MOST_GRID_LIGHTS = (2**32 - 1) // GRID_LIGHT.itemsize

_SCATTERED = 65_536
"""So many vertices more than S1 may S2 and up have. They are found from where the lights of S1 are, which may be a cell
without any input light: each has eight around it. Few lights, all alone, make more of them than there are of S1."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of a build's buffers.

    Attributes:
        inputs: lights.    most: S1 must have fewer vertices than this, where the number of levels is chosen.
        first_candidate, last_candidate: numbers of levels that are tried. The first can't fail.
        half: words of the vertices of all levels.    capacity: rows of the merged lights.
        level_rows: the most vertices of levels 1, 2, ...; the shares of `capacity`.
        key_bits: of a cell of level 1.    slots: of member lists; 0 where nothing is drawn from them.

    """

    inputs: int
    most: int
    first_candidate: int
    last_candidate: int
    half: int
    capacity: int
    level_rows: tuple[int, ...]
    key_bits: int
    slots: int

    @property
    def sum_rows(self) -> int:
        """The most vertices of a level."""
        return max(self.level_rows)

    def rows_of(self, first: int, last: int = 12) -> int:
        """The most vertices of levels `first` to `last` together."""
        return sum(self.level_rows[first - 1 : last])


def hierarchy_sizes(count: int, params: Params) -> Sizes:
    """Room for `count` lights, or a :class:`LabError` where that is too much for the engine."""
    if count > MOST_LIGHTS:
        raise LabError(f"{count} lights: the Vulkan engine takes at most {MOST_LIGHTS}; use --engine cpu for more")
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
    coarser = min(8 * largest, largest + _SCATTERED)
    kept = tuple(min(_side(last, level) ** 3, largest if level == 1 else coarser) for level in range(1, last + 1))
    if max(kept) > _MOST_ROWS or count + sum(kept) > _MOST_GRID_LIGHTS:
        raise LabError(
            f"{count} lights, levels={params.levels}: there may be {count + sum(kept):,} grid lights, more than the "
            "Vulkan engine has room for; use fewer levels, or --engine cpu"
        )
    slots = _member_slots(count, kept, params) if draws_members(params) else 0
    if slots > MOST_SLOTS:
        raise LabError(
            f"{count} lights, levels={params.levels}: the lists that shadow points are drawn from may take {slots:,} "
            f"slots, the Vulkan engine has {MOST_SLOTS:,}; use fewer lights or levels, shadow_points=jitter, or "
            "--engine cpu"
        )
    return Sizes(
        inputs=count,
        most=most,
        first_candidate=first,
        last_candidate=last,
        half=sum(_words(last, level) for level in range(1, last + 1)),
        capacity=count + sum(kept),
        level_rows=kept,
        key_bits=max(1, 3 * (last - 1)),
        slots=slots,
    )


def _member_slots(count: int, kept: tuple[int, ...], params: Params) -> int:
    """The most slots of member lists: a light lies in those of eight vertices of each level that is made of its own."""
    half_open = params.construction == "gather" and params.gather_range == "half_open"
    sources = [count] + [kept[0 if half_open or level == 2 else 1] for level in range(2, len(kept) + 1)]
    return 8 * sum(sources)


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
