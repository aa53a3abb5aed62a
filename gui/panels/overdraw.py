"""How many lights a pixel looks at: by level, as a distribution, and as the number of lights grows (LY19 4)."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from gui.panels.panel import Panel
from gui.panels.plot_url import plot_url
from gui.plots import growth_plot, overdraw_levels_plot, overdraw_plot, to_png
from lab.records import Frame
from lab.survey import CountStatistics, OverdrawGrowth, OverdrawSurvey, overdraw_growth, overdraw_survey

_PLOT_PX = (430, 270)


class OverdrawPanel(Panel):
    """A table of levels, their histograms, and Figure 5 when asked for."""

    _of: tuple[Frame, str] | None = None
    _survey: OverdrawSurvey | None = None
    _growth: OverdrawGrowth | None = None

    def build(self) -> None:
        """Table, histograms, growth."""
        state = self.state
        state.overdraw_rows, state.overdraw_plot, state.overdraw_growth = [], "", ""
        state.overdraw_counted, state.overdraw_level = "overdraw", -1
        with html.Div(classes="lab-columns"):
            with html.Div(classes="lab-column"):
                with html.Div(classes="lab-table-head"):
                    for name, title in (("overdraw", "overdraw"), ("lights_used", "lights used")):
                        v3.VBtn(
                            title, size="x-small", variant=(f"overdraw_counted == '{name}' ? 'tonal' : 'text'",),
                            click=(self._count, f"['{name}']"), id=f"counted-{name}",
                        )  # fmt: skip
                with html.Table(classes="lab-data", id="overdraw-table"):
                    with html.Thead(), html.Tr():
                        for head in ("level", "lights", "mean", "median", "95 %", "max"):
                            html.Th(head)
                    with (
                        html.Tbody(),
                        html.Tr(
                            v_for="row in overdraw_rows", key="row.level", click=(self._choose, "[row.level]"),
                            classes=("row.level == overdraw_level ? 'lab-chosen' : ''",),
                            title="show this level's heatmap and histogram",
                        ),
                    ):  # fmt: skip
                        html.Td("{{ cell }}", v_for="(cell, i) in row.cells", key="i")
            with html.Div(classes="lab-column"):
                html.Img(src=("overdraw_plot",), v_if=("overdraw_plot",), classes="lab-plot", id="overdraw-plot")
            with html.Div(classes="lab-column"):
                with html.Div(classes="lab-ask"):
                    v3.VBtn(
                        "measure the growth", size="x-small", variant="outlined", click=self._grow, id="overdraw-grow"
                    )
                    html.Span("mean overdraw of this view against the number of grid lights (LY19 Figure 5)")
                html.Img(src=("overdraw_growth",), v_if=("overdraw_growth",), classes="lab-plot", id="growth-plot")

    def show(self) -> None:
        """The counts of the frame."""
        state, frame = self.state, self.app.frame
        if frame is None:
            return
        if self._of is None or self._of[0] is not frame or self._of[1] != state.overdraw_counted:
            self._of = frame, state.overdraw_counted
            self._survey = overdraw_survey(frame, state.overdraw_counted)
        survey = self._survey
        if survey is None:
            return
        hierarchy = frame.hierarchy
        drawn = [
            found for found in survey.levels if found.level is not None and found.level >= frame.params.first_level
        ]
        sizes = {level.level: len(level) for level in hierarchy.levels}
        rows = [(found.level, sizes[found.level or 0], found) for found in drawn]
        total = sum(size for _, size, _ in rows)
        state.overdraw_rows = [
            _row(level, f"{level}", size, found) for level, size, found in rows
        ] + [_row(-1, "all", total, survey.total)]  # fmt: skip
        chosen = state.overdraw_level
        known = chosen in [level for level, _, _ in rows]
        figure = overdraw_plot(survey, chosen) if known else overdraw_levels_plot(survey)
        state.overdraw_plot = plot_url(figure, *_PLOT_PX)

    def screenshot(self) -> bytes:
        """The histograms of all levels."""
        return b"" if self._survey is None else to_png(overdraw_levels_plot(self._survey), 960, 600)

    def _count(self, name: str) -> None:
        self.state.overdraw_counted = name
        self.app.look(layer=name)

    def _choose(self, level: int) -> None:
        """Shows one level's histogram, and its heatmap in the picture; -1: the total."""
        counted = self.state.overdraw_counted
        self.state.overdraw_level = level
        self.app.look(layer=counted if level < 0 else f"{counted}.L{level}")

    def _grow(self) -> None:
        frame, renderer = self.app.frame, self.app.workbench.renderer
        if frame is None:
            return

        def work(progress: Any) -> OverdrawGrowth:
            with renderer.on_threads():
                return overdraw_growth(
                    renderer.engine, frame.gbuffer, progress=lambda share, said: progress(f"{100 * share:.0f} % {said}")
                )

        def done(growth: OverdrawGrowth) -> None:
            self.state.overdraw_growth = plot_url(growth_plot(growth), *_PLOT_PX)

        self.app.run("growth", work, done)


def _row(level: int | None, name: str, lights: int, found: CountStatistics) -> dict[str, Any]:
    cells = [name, f"{lights:,}", f"{found.mean:.4g}", f"{found.median:g}", f"{found.p95:.4g}", f"{found.max:,}"]
    return {"level": level, "cells": cells}
