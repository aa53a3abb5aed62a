"""The grid lights of any set of levels, as spheres sized by flux."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gui.scene_view.actors import Part
from gui.scene_view.clouds import LARGEST_PX, Cloud, sizes_px
from gui.scene_view.colours import LEVELS, RAMP, Bytes, ramp_colours
from gui.scene_view.legend import Bar, Block
from lab import LabError
from lab.colour import luminance
from lab.errors import nearest
from lab.figure import nice_ticks
from lab.grid_lights import relative_deviation
from lab.records import Hierarchy

COLOUR_BY = ("flux", "level", "deviation")

_DECADES = 4.0  # of flux below the brightest light, over which spheres grow from the smallest size to the largest


class LevelsPart(Part):
    """Grid lights. The points of a level are made once; which levels are shown costs nothing to change."""

    def __init__(self, renderer: Any) -> None:
        super().__init__(renderer)
        self._hierarchy: Hierarchy | None = None
        self._colour_by = ""
        self._clouds: dict[int, Cloud] = {}
        self._levels: list[int] = []
        self._size, self._moving = 1.0, False
        self._flux: NDArray[np.floating] = np.empty(0)
        self._deviation: NDArray[np.floating] = np.empty(0)
        self._scale: tuple[float, float] = (0.0, 1.0)

    @property
    def hierarchy(self) -> Hierarchy | None:
        """Whose lights are shown."""
        return self._hierarchy

    @property
    def shown(self) -> list[int]:
        """The levels that are shown."""
        return self._levels

    def show(self, hierarchy: Hierarchy, levels: Collection[int], colour_by: str, size: float) -> None:
        """Shows `levels` of `hierarchy`."""
        if colour_by not in COLOUR_BY:
            raise LabError(f"colour_by={colour_by!r}: there are {', '.join(COLOUR_BY)}{nearest(colour_by, COLOUR_BY)}")
        wrong = [level for level in levels if not 0 <= level <= hierarchy.top]
        if wrong:
            raise LabError(f"levels {wrong}: this hierarchy has levels 0 to {hierarchy.top}")
        if size <= 0:
            raise LabError(f"size={size}: allowed is > 0")
        if hierarchy is not self._hierarchy:
            self._flux, self._deviation = np.asarray(luminance(hierarchy.flux)), relative_deviation(hierarchy)
        scale = _scale_of(colour_by, self._values(hierarchy, levels, colour_by))
        if hierarchy is not self._hierarchy or (colour_by, scale) != (self._colour_by, self._scale):
            self.clear()
        self._hierarchy, self._colour_by, self._scale = hierarchy, colour_by, scale
        self._levels, self._size = sorted(levels), size
        for level in self._levels:
            if level not in self._clouds:
                self._clouds[level] = self._cloud(hierarchy, level)
        self.legend = self._legend(hierarchy)
        self.set_moving(self._moving)

    def clear(self) -> None:
        """Removes all levels."""
        super().clear()
        self._clouds.clear()
        self._hierarchy, self._levels = None, []

    def set_moving(self, moving: bool) -> None:
        """Thinned out while the view moves."""
        self._moving = moving
        for level, cloud in self._clouds.items():
            if level in self._levels:
                cloud.show(moving, self._size)
            else:
                cloud.hide()

    def _cloud(self, hierarchy: Hierarchy, level: int) -> Cloud:
        rows = slice(int(hierarchy.offset[level]), int(hierarchy.offset[level + 1]))
        return Cloud(self, hierarchy.position[rows], self._colours(level, rows), self._weight(rows))

    @property
    def largest_px(self) -> float:
        """Largest diameter that a light is drawn with, in pixels."""
        return self._size * LARGEST_PX

    def radii_px(self, rows: NDArray[np.integer]) -> NDArray[np.floating]:
        """(n,) radii in pixels that the lights of merged indices `rows` are drawn with."""
        return np.asarray(self._size * sizes_px(self._weight(rows)) / 2)

    def _weight(self, rows: slice | NDArray[np.integer]) -> NDArray[np.floating]:
        brightest = max(float(self._flux.max()), 1e-30)
        return np.asarray(1 + np.log10(np.maximum(self._flux[rows] / brightest, 1e-30)) / _DECADES)

    def _colours(self, level: int, rows: slice) -> Bytes:
        if self._colour_by == "level":
            return np.tile(np.asarray(LEVELS[level], np.uint8), (rows.stop - rows.start, 1))
        low, high = self._scale
        values = self._deviation[rows] if self._colour_by == "deviation" else _log(self._flux[rows])
        return ramp_colours((values - low) / (high - low))

    def _values(self, hierarchy: Hierarchy, levels: Collection[int], colour_by: str) -> NDArray[np.floating]:
        """What the colours of `levels` stand for."""
        values = self._deviation if colour_by == "deviation" else self._flux
        parts = [values[slice(*hierarchy.offset[level : level + 2])] for level in levels]
        return np.concatenate(parts) if parts else values[:0]

    def _legend(self, hierarchy: Hierarchy) -> Block | None:
        if not self._levels:
            return None
        counts = np.diff(hierarchy.offset)
        by_level = self._colour_by == "level"
        rows = [
            (LEVELS[level] if by_level else None, f"{_level_name(level, hierarchy.top)}: {counts[level]:,}")
            for level in self._levels
        ]
        low, high = self._scale
        bar = None
        if self._colour_by == "flux":
            powers = range(math.ceil(low), math.floor(high) + 1, max(1, round((high - low) / 4)))
            ticks = [((power - low) / (high - low), f"1e{power}") for power in powers]
            bar = Bar("flux, luminance (scene's power)", RAMP, ticks)
        elif self._colour_by == "deviation":
            ticks = [(value / high, f"{value:g}") for value in nice_ticks(high, 5, least=0.01)]
            bar = Bar("position deviation / cell size", RAMP, ticks)
        return Block("grid lights, larger = more flux", rows, bar)


def _level_name(level: int, top: int) -> str:
    return f"level {level}" + (" (input)" if level == 0 else " (top)" if level == top else "")


def _log(flux: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.asarray(np.log10(np.maximum(flux, 1e-30)))


def _scale_of(colour_by: str, values: NDArray[np.floating]) -> tuple[float, float]:
    """Both ends of a colour scale; of flux in powers of ten, without the dimmest hundredth, which reaches far down."""
    if colour_by == "level" or not values.size:
        return 0.0, 1.0
    if colour_by == "deviation":
        return 0.0, max(float(values.max()), 0.01)
    low, high = float(_log(np.quantile(values, 0.01))), float(_log(values.max()))
    return (low, high) if high - low > 1 else (high - 1, high)
