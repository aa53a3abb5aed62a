"""Where the frame is brighter or darker than it should be, and which pixel to ask for the reason."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from trame.widgets import html
from trame.widgets import vuetify3 as v3

from gui.layers import data_url, draw_layer, png_bytes
from gui.panels.panel import Panel
from gui.sources import TITLES
from lab.records import Frame
from lab.reference import METHODS, Reference
from lab.survey import LeakMap, Spot, leak_map

SPOTS = 12
RADII = (0, 2, 4, 8)
_SCALE = 1.0
_DEVIATIONS = 2.0


class LeaksPanel(Panel):
    """The signed error against a reference, its worst places, and the way to the pixel behind each."""

    _of: tuple[Frame, Reference] | None = None
    _map: LeakMap | None = None

    def build(self) -> None:
        """Choice of the reference, numbers, the map, the worst places."""
        state = self.state
        state.leak_method, state.leak_rows, state.leak_picture, state.leak_spots = "brute_force", [], "", []
        state.leak_said, state.leak_radius = "", 4
        with html.Div(classes="lab-columns"):
            with html.Div(classes="lab-column"):
                html.Div("Compare the indirect light with", classes="lab-head")
                for method in METHODS:
                    v3.VBtn(
                        TITLES[method], size="x-small", variant=(f"leak_method == '{method}' ? 'tonal' : 'outlined'",),
                        click=(self._ask, f"['{method}']"), id=f"leaks-{method}", classes="lab-gap",
                    )  # fmt: skip
                v3.VBtn(
                    "refine", size="x-small", variant="text", click=self._refine, v_show=("leak_rows.length",),
                    id="leaks-refine", title="go on from the samples there are, for as long again",
                )  # fmt: skip
                html.Div("{{ leak_said }}", classes="lab-quiet", v_if=("leak_said",))
                with html.Table(classes="lab-pairs", id="leak-table"), html.Tr(v_for="row in leak_rows", key="row[0]"):
                    html.Td("{{ row[0] }}")
                    html.Td("{{ row[1] }}")
            with html.Div(classes="lab-column"):
                html.Img(src=("leak_picture",), v_if=("leak_picture",), classes="lab-map", id="leak-map")
                with html.Div(classes="lab-table-head", v_if=("leak_picture",)):
                    html.Span("red: too bright, blue: too dark, full at 100 %; averaged over", classes="lab-line")
                    for radius in RADII:
                        v3.VBtn(
                            f"{2 * radius + 1}", size="x-small", click=(self._smooth, f"[{radius}]"),
                            variant=(f"leak_radius == {radius} ? 'tonal' : 'text'",), id=f"leak-radius-{radius}",
                            classes="lab-level", title=f"{2 * radius + 1} x {2 * radius + 1} pixels",
                        )  # fmt: skip
            with html.Div(classes="lab-column"):
                html.Div("the worst places", classes="lab-head", v_if=("leak_spots.length",))
                html.Div(
                    "{{ spot.text }}", v_for="spot in leak_spots", key="spot.text", classes="lab-line lab-link",
                    click=(self._visit, "[spot.pixel]"), title="probe this pixel and ask who answers for it",
                )  # fmt: skip

    def show(self) -> None:
        """The map, where the reference has been made."""
        state, app = self.state, self.app
        frame, reference = app.frame, app.sources.reference(state.leak_method)
        state.leak_said = ""
        if frame is None or reference is None:
            self._of = self._map = None
            state.leak_rows, state.leak_picture, state.leak_spots, state.marks = [], "", [], []
            if app.frame is not None:
                state.leak_said = "Choose a reference: it takes up to half a minute, and is kept for the next time."
            return
        if self._of is None or self._of[0] is not frame or self._of[1] is not reference:
            self._of, self._map = (frame, reference), leak_map(frame, reference)
        found = self._map
        if found is None:
            return
        brighter, darker = found.shares(deviations=_DEVIATIONS)
        state.leak_rows = [
            ["reference", TITLES[found.method]],
            ["its relative error", f"{100 * reference.relative_error:.2f} %"],
            ["over 10 % too bright", f"{100 * brighter:.1f} % of the pixels, beyond its noise"],
            ["over 10 % too dark", f"{100 * darker:.1f} % of the pixels, beyond its noise"],
            ["energy ratio", f"{found.energy_ratio:.4f}"],
            ["relMSE", f"{found.rel_mse:.4g}, of which noise {found.rel_mse_noise:.2g}"],
        ]
        state.leak_picture = data_url(self._picture(found))
        width, height = frame.gbuffer.size
        spots = found.worst(SPOTS, min(16, width, height), _DEVIATIONS)
        state.leak_spots = [{"text": _text(spot), "pixel": [spot.x, spot.y]} for spot in spots]
        state.marks = [[spot.x, spot.y] for spot in spots]

    def hide(self) -> None:
        """The marks in the picture belong to this panel."""
        self.state.marks = []

    def screenshot(self) -> bytes:
        """The map."""
        return b"" if self._map is None else png_bytes(self._picture(self._map))

    def _picture(self, found: LeakMap) -> NDArray[np.uint8]:
        error = found.smoothed(int(self.state.leak_radius)) if self.state.leak_radius else found.error
        return draw_layer(error, "signed", low=-_SCALE, high=_SCALE, seen=found.seen)

    def _ask(self, method: str) -> None:
        self.state.leak_method = method
        if self.app.sources.reference(method) is None:
            self._refine()
        self.app.refresh()

    def _smooth(self, radius: int) -> None:
        self.state.leak_radius = radius
        self.app.refresh()

    def _refine(self) -> None:
        """Makes the reference, or goes on with it."""
        method = str(self.state.leak_method)

        def done(put: Callable[[], None]) -> None:
            put()
            self.app.refresh()

        self.app.run("reference", self.app.sources.maker(method), done)

    def _visit(self, pixel: list[int]) -> None:
        self.app.look(pixel=(int(pixel[0]), int(pixel[1])), panel="pixel")
        self.app.ask_for_account()


def _text(spot: Spot) -> str:
    sign = "too bright" if spot.error > 0 else "too dark"
    return f"({spot.x}, {spot.y})  {100 * spot.error:+.0f} %, {sign}: {100 * spot.weight:.2f} % of all light"
