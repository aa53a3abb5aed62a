"""The cells of a level that hold lights, as a wire frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gui.scene_view.actors import Part, lines_actor
from gui.scene_view.colours import LEVELS
from gui.scene_view.legend import Block
from lab.grid_lights import occupied_cells
from lab.records import Hierarchy

MOST = 20_000
"""Cells that are drawn; of more, those with most lights."""


class CellsPart(Part):
    """The cells of one level."""

    def show(self, hierarchy: Hierarchy, level: int | None) -> str:
        """Shows the cells of `level` (None: none); returns what was left out, "" for nothing."""
        self.clear()
        if level is None:
            return ""
        cells, lights = occupied_cells(hierarchy, level)
        note, counted = "", f"level {level}: {len(cells):,}"
        if len(cells) > MOST:
            fullest = np.sort(np.argsort(-lights, kind="stable")[:MOST])
            note = f"{MOST:,} of {len(cells):,} cells of level {level} are shown: those with most lights"
            cells, counted = cells[fullest], f"level {level}: {MOST:,} of {len(cells):,}, the fullest"
        size = float(hierarchy.cell_size[level])
        ends = _edges(cells) * size + hierarchy.origin.astype(np.float64)
        red, green, blue = LEVELS[level]
        dimmed = (red * 2 // 3, green * 2 // 3, blue * 2 // 3)
        self.add(lines_actor(ends, dimmed))
        self.legend = Block("cells with lights", [(dimmed, counted)])
        return note


def _edges(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The edges of (c, 3) unit cells as (e, 2, 3) vertices, each once, however many cells share it."""
    side = int(cells.max()) + 2
    across = np.array([1, side, side * side])
    lowest = cells @ across
    keys = []
    for axis in range(3):
        u, v = across[[a for a in range(3) if a != axis]]
        keys.append(np.unique(np.concatenate([lowest, lowest + u, lowest + v, lowest + u + v])))
    starts = np.concatenate(keys)
    stops = np.concatenate([key + step for key, step in zip(keys, across, strict=True)])
    both = np.stack([starts, stops], axis=1)
    return np.stack([both % side, both // side % side, both // side**2], axis=-1)
