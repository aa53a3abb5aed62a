"""The levels of the hierarchy: how many lights, how much flux, how often looked at."""

from __future__ import annotations

from trame.widgets import html

from gui.layers.read_out import number_text
from gui.panels.panel import Panel
from gui.panels.plot_url import plot_url
from gui.plots import levels_plot, to_png
from lab.colour import luminance
from lab.records import Frame
from lab.report import Record, level_records

_HEADS = ("level", "cell size", "blend radius", "lights", "flux (luminance)", "overdraw, mean", "used, mean")
_PLOT_PX = (560, 280)


class LevelsPanel(Panel):
    """A row a level, and the same drawn."""

    _of: Frame | None = None
    _rows: list[Record] | None = None

    def build(self) -> None:
        """Table and plot."""
        self.state.level_rows, self.state.levels_plot = [], ""
        with html.Div(classes="lab-columns lab-two"):
            with html.Div(classes="lab-column"), html.Table(classes="lab-data", id="levels-table"):
                with html.Thead(), html.Tr():
                    for head in _HEADS:
                        html.Th(head)
                with (
                    html.Tbody(),
                    html.Tr(v_for="row in level_rows", key="row.level", click=(self._choose, "[row.level]")),
                ):
                    html.Td("{{ cell }}", v_for="(cell, i) in row.cells", key="i")
            with html.Div(classes="lab-column"):
                html.Img(src=("levels_plot",), v_if=("levels_plot",), classes="lab-plot", id="levels-plot")

    def show(self) -> None:
        """The frame's levels."""
        frame = self.app.frame
        if frame is None or frame is self._of:
            return
        self._of = frame
        self._rows = level_records(frame.hierarchy, frame.lighting, frame.gbuffer.depth > 0)
        self.state.level_rows = [
            {"level": row["level"], "cells": _cells(row, frame.params.alpha)} for row in self._rows
        ]
        self.state.levels_plot = plot_url(levels_plot(self._rows), *_PLOT_PX)

    def screenshot(self) -> bytes:
        """The plot."""
        return b"" if self._rows is None else to_png(levels_plot(self._rows), 1100, 520)

    def _choose(self, level: int) -> None:
        """Shows that level in the scene."""
        self.app.look(levels=(level,))


def _cells(row: Record, alpha: float) -> list[str]:
    return [
        f"{row['level']}",
        number_text(row["cell_size"]),
        number_text(alpha * row["cell_size"]),
        f"{row['grid_lights']:,}",
        number_text(float(luminance(row["flux"]))),
        f"{row['overdraw_mean']:.4g}",
        f"{row['lights_used_mean']:.4g}",
    ]
