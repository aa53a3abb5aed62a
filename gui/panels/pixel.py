"""The pixel probe: every grid light behind the pixel, its picks, and what they are expected to be."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from gui.panels.panel import Panel
from gui.panels.pixel_tables import account_table, light_rows, picks_text, summary, trials_table
from gui.panels.plot_url import plot_url
from gui.plots import blend_plot, picks_plot, to_png
from lab.pixel import Account, ExactShadow, PickTrials, Probe, account, exact_shadow, sample_pixel
from lab.records import Frame

MOST_ROWS = 150
DRAWS = 4096
_ORDERS = ("share", "level")
_PLOT_PX = (470, 250)


class PixelPanel(Panel):
    """A table of lights in the middle; what the pixel is at the left; samples, exact values, blame at the right."""

    _of: tuple[Frame, tuple[int, int]] | None = None
    _key: tuple[object, ...] = ()
    _trials: PickTrials | None = None
    _exact: ExactShadow | None = None
    _account: Account | None = None
    _tab_shown: tuple[object, ...] = (None,) * 6

    def build(self) -> None:
        """Three columns."""
        state = self.state
        state.pixel_summary, state.pixel_rows, state.pixel_said, state.pixel_order = [], [], "", "share"
        state.pixel_plot, state.pixel_results, state.pixel_result_head, state.pixel_tab = "", [], [], "blend"
        state.pixel_draws, state.light, state.pixel_picks = DRAWS, None, []
        self.app.ctrl.trigger("probe_file")(self._file)
        with html.Div(classes="lab-pixel", v_show=("pixel",)):
            self._left()
            self._table()
            self._right()
        html.Div("Click a pixel of the picture, or a point of the scene.", v_show=("!pixel",), classes="lab-quiet")

    def show(self) -> None:
        """The probe of the selected pixel."""
        state, probe = self.state, self.app.probe
        state.pixel, state.light = list(self.app.pixel) if self.app.pixel else None, self.app.light
        if probe is None or self.app.frame is None or self.app.pixel is None:
            return
        of = self.app.frame, self.app.pixel
        if self._of is None or self._of[0] is not of[0] or self._of[1] != of[1]:
            self._of, self._trials, self._exact, self._account = of, None, None, None
        key = *map(id, (of[0], self._trials, self._exact, self._account)), of[1], state.pixel_order
        if key == self._key:
            return
        self._key = key
        lights = probe.lights.sorted()
        if state.pixel_order == "level":
            order = sorted(range(len(lights)), key=lambda row: int(lights.level[row]))
            rows = light_rows(lights, order[:MOST_ROWS])
        else:
            rows = light_rows(lights, range(min(MOST_ROWS, len(lights))))
        state.pixel_rows = rows
        state.pixel_said = f"{len(lights):,} lights" + (
            f", the first {len(rows)} shown" if len(rows) < len(lights) else ""
        )
        state.pixel_summary = summary(probe, self._exact, self._trials)
        state.pixel_picks = picks_text(probe)
        self.app.later("pixel", lambda: self._show_tab(probe))

    def _show_tab(self, probe: Probe) -> None:
        state, frame = self.state, self.app.frame
        shown = frame, probe, self._trials, self._exact, self._account, state.pixel_tab
        if all(now is before for now, before in zip(shown, self._tab_shown, strict=True)):
            return  # a plot takes a tenth of a second
        self._tab_shown = shown
        state.pixel_plot, state.pixel_results, state.pixel_result_head = "", [], []
        if frame is None:
            return
        width, height = _PLOT_PX
        if state.pixel_tab == "blend":
            figure = blend_plot(frame.params, frame.hierarchy, probe)
            state.pixel_plot = plot_url(figure, width, height)
        elif state.pixel_tab == "samples" and self._trials is not None:
            state.pixel_plot = plot_url(picks_plot(self._trials), width, height)
            state.pixel_result_head, state.pixel_results = trials_table(self._trials, self._exact)
        elif state.pixel_tab == "account" and self._account is not None:
            state.pixel_result_head, state.pixel_results = account_table(self._account)

    def screenshot(self) -> bytes:
        """The blend weights with the pixel's lights."""
        probe, frame = self.app.probe, self.app.frame
        return (
            b""
            if probe is None or frame is None
            else to_png(blend_plot(frame.params, frame.hierarchy, probe), 960, 540)
        )

    # --- what the user does -------------------------------------------------------------------------

    def _choose_tab(self, name: str) -> None:
        with self.state:
            self.state.pixel_tab = name
            if self.app.probe is not None:
                self._show_tab(self.app.probe)

    def _choose_order(self, name: str) -> None:
        with self.state:
            self.state.pixel_order = name
            self.show()

    def _sample(self) -> None:
        """Draws the pixel's picks many times, and computes what they should be from every ray."""
        draws = str(self.state.pixel_draws)
        if not draws.isdecimal() or not 1 <= int(draws) <= 2**20:
            self.app.say(f"sample {draws} times: expected a whole number from 1 to {2**20}")
            return
        self._work("sample", "samples", int(draws))

    def blame(self) -> None:
        """Asks which lights answer for the difference to the sum over all input lights."""
        self._work("account", "account", 0)

    def _work(self, name: str, tab: str, draws: int) -> None:
        of, renderer = self._of, self.app.workbench.renderer
        if of is None:
            return
        frame, (x, y) = of

        def work(progress: Any) -> tuple[PickTrials | None, ExactShadow, Account | None]:
            progress(f"pixel {x}, {y}")
            with renderer.on_threads():
                engine = self.app.workbench.engine
                exact = exact_shadow(engine, frame, x, y)
                if draws:
                    return sample_pixel(engine, frame, x, y, draws, seed=frame.params.seed), exact, None
                return None, exact, account(engine, frame, x, y)

        def done(found: tuple[PickTrials | None, ExactShadow, Account | None]) -> None:
            if self._of is not of:
                return  # another pixel was chosen meanwhile
            self._trials, self._exact = found[0] or self._trials, found[1]
            self._account = found[2] or self._account
            self.state.pixel_tab = tab
            self.show()

        self.app.run(name, work, done)

    def _file(self, ending: str) -> str:
        """The probe as text of a file."""
        probe = self.app.probe
        if probe is None:
            return ""
        return probe.to_csv() if ending == "csv" else probe.to_json()

    # --- widgets ------------------------------------------------------------------------------------

    def _left(self) -> None:
        with html.Div(classes="lab-pixel-left"):
            with (
                html.Table(classes="lab-pairs", id="pixel-summary"),
                html.Tr(v_for="row in pixel_summary", key="row[0]"),
            ):
                html.Td("{{ row[0] }}")
                html.Td("{{ row[1] }}")
            html.Div("picks of this frame", classes="lab-head")
            html.Div("{{ line }}", v_for="line in pixel_picks", key="line", classes="lab-line")

    def _table(self) -> None:
        heads = ("light", "level", "distance", "B", "cos", "lobe", "E", "f", "p", "share", "sum")
        with html.Div(classes="lab-pixel-table"):
            with html.Div(classes="lab-table-head"):
                html.Span("{{ pixel_said }}", classes="lab-head")
                for order in _ORDERS:
                    v3.VBtn(
                        f"by {order}", size="x-small", variant=(f"pixel_order == '{order}' ? 'tonal' : 'text'",),
                        click=(self._choose_order, f"['{order}']"), id=f"order-{order}",
                    )  # fmt: skip
                v3.VSpacer()
                for ending in ("json", "csv"):
                    v3.VBtn(
                        ending, size="x-small", variant="text", id=f"probe-{ending}",
                        click="utils.download('pixel-' + pixel.join('-') + "
                        f"'.{ending}', trigger('probe_file', ['{ending}']), 'text/plain')",
                    )  # fmt: skip
            with html.Div(classes="lab-scroll"), html.Table(classes="lab-data", id="pixel-lights"):
                with html.Thead(), html.Tr():
                    for head in heads:
                        html.Th(head)
                with html.Tbody(), html.Tr(
                    v_for="row in pixel_rows", key="row.index", click=(self.app.select_light, "[row.index]"),
                    classes=("row.index == light ? 'lab-chosen' : ''",),
                ):  # fmt: skip
                    html.Td("{{ cell }}", v_for="(cell, i) in row.cells", key="i")

    def _right(self) -> None:
        with html.Div(classes="lab-pixel-right"):
            with html.Div(classes="lab-table-head"):
                for name, title in (("blend", "blend weights"), ("samples", "samples"), ("account", "who answers")):
                    v3.VBtn(
                        title, size="x-small", variant=(f"pixel_tab == '{name}' ? 'tonal' : 'text'",),
                        click=(self._choose_tab, f"['{name}']"), id=f"pixel-tab-{name}",
                    )  # fmt: skip
            with html.Div(classes="lab-ask", v_show=("pixel_tab == 'samples'",)):
                html.Input(v_model=("pixel_draws",), id="pixel-draws", classes="lab-input")
                v3.VBtn("sample this pixel", size="x-small", variant="outlined", click=self._sample, id="pixel-sample")
            with html.Div(classes="lab-ask", v_show=("pixel_tab == 'account'",)):
                v3.VBtn("ask every light", size="x-small", variant="outlined", click=self.blame, id="pixel-account")
                html.Span("a shadow ray to each input light, and each grid light against what it stands for")
            with html.Div(classes="lab-scroll"):
                html.Img(src=("pixel_plot",), v_if=("pixel_plot",), classes="lab-plot", id="pixel-plot")
                with html.Table(classes="lab-data", v_if=("pixel_results.length",), id="pixel-results"):
                    with html.Thead(), html.Tr():
                        html.Th("{{ head }}", v_for="head in pixel_result_head", key="head")
                    with html.Tbody(), html.Tr(v_for="(row, n) in pixel_results", key="n"):
                        html.Td("{{ cell }}", v_for="(cell, i) in row", key="i")
