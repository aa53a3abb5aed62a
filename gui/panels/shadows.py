"""Where shadow samples go over the whole picture, by importance and evenly, before and after the filter (LY19 7, 8)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from trame.widgets import html
from trame.widgets import vuetify3 as v3

from gui.layers import data_url, draw_layer
from gui.panels.panel import Panel
from gui.panels.plot_url import plot_url
from gui.plots import distribution_plot, level_shares_plot, to_png
from gui.plots.shadows import MAPS
from lab.records import Frame
from lab.survey import ImportanceComparison, ShadowDistribution, compare_importance, shadow_distribution

PICKS = 64
_PLOT_PX = (430, 270)
_WORDS = {
    "entropy": "entropy, bits",
    "effective_lights": "effective lights",
    "mean_level": "mean level",
    "blocked": "rays blocked",
    "without_ray": "picks without a ray",
    "lights_picked": "lights ever picked",
}


class ShadowsPanel(Panel):
    """The frame's own picks; on request both ways of picking with many more of them."""

    _of: Frame | None = None
    _own: ShadowDistribution | None = None
    _both: ImportanceComparison | None = None

    def build(self) -> None:
        """Numbers, plots, maps."""
        state = self.state
        state.shadow_rows, state.shadow_heads, state.shadow_plot, state.shadow_map = [], [], "", "levels"
        state.shadow_pictures, state.shadow_top = [], []
        with html.Div(classes="lab-columns"):
            with html.Div(classes="lab-column"):
                with html.Div(classes="lab-ask"):
                    v3.VBtn(
                        f"importance on and off, {PICKS} picks", size="x-small", variant="outlined",
                        click=self._compare, id="compare-importance",
                    )  # fmt: skip
                with html.Table(classes="lab-data", id="shadow-table"):
                    with html.Thead(), html.Tr():
                        html.Th("{{ head }}", v_for="head in shadow_heads", key="head")
                    with html.Tbody(), html.Tr(v_for="(row, n) in shadow_rows", key="n"):
                        html.Td("{{ cell }}", v_for="(cell, i) in row", key="i")
                html.Div("picked most often", classes="lab-head")
                html.Div(
                    "{{ line.text }}", v_for="line in shadow_top", key="line.light", classes="lab-line lab-link",
                    click=(self.app.select_light, "[line.light]"),
                )  # fmt: skip
            with html.Div(classes="lab-column"):
                with html.Div(classes="lab-table-head"):
                    for name, title in (("levels", "levels"), *((key, found[0]) for key, found in MAPS.items())):
                        v3.VBtn(
                            title.replace(" of the picks", "").replace("effective number of ", "effective "),
                            size="x-small", variant=(f"shadow_map == '{name}' ? 'tonal' : 'text'",),
                            click=(self._choose, f"['{name}']"), id=f"shadow-map-{name}",
                        )  # fmt: skip
                html.Img(src=("shadow_plot",), v_if=("shadow_plot",), classes="lab-plot", id="shadow-plot")
            with (
                html.Div(classes="lab-column"),
                html.Div(classes="lab-pictures", id="shadow-pictures"),
                html.Div(v_for="picture in shadow_pictures", key="picture.title"),
            ):
                html.Img(src=("picture.url",))
                html.Div("{{ picture.title }}", classes="lab-line")

    def show(self) -> None:
        """The distribution of the frame's picks."""
        state, frame = self.state, self.app.frame
        if frame is None:
            return
        if frame is not self._of:
            self._of, self._both = frame, None
            self._own = shadow_distribution(frame) if frame.params.shadow_samples else None
        sides = self._sides()
        if not sides:
            state.shadow_heads, state.shadow_rows, state.shadow_plot = ["shadow_samples = 0: nothing is picked"], [], ""
            state.shadow_top, state.shadow_pictures = [], []
            return
        summaries = [found.summary() for found in sides.values()]
        state.shadow_heads = ["", *sides]
        state.shadow_rows = [[word, *(_text(name, s[name]) for s in summaries)] for name, word in _WORDS.items()]
        first = next(iter(sides.values()))
        state.shadow_top = [
            {
                "light": top.light,
                "text": f"light {top.light} (level {top.level}): {100 * top.share:.2f} % of the picks"
                + (f", {100 * top.blocked:.0f} % blocked" if np.isfinite(top.blocked) else ""),
            }
            for top in first.top_lights(8)
        ]
        state.shadow_plot = plot_url(self._figure(), *_PLOT_PX)
        state.shadow_pictures = self._pictures()

    def screenshot(self) -> bytes:
        """The plot that is open."""
        return to_png(self._figure(), 960, 600) if self._sides() else b""

    def _sides(self) -> dict[str, ShadowDistribution]:
        if self._both is not None:
            return {"by importance": self._both.on.distribution, "evenly": self._both.off.distribution}
        return {} if self._own is None else {"this frame": self._own}

    def _figure(self) -> Any:
        name = self.state.shadow_map
        return level_shares_plot(self._sides()) if name == "levels" else distribution_plot(self._sides(), name)

    def _pictures(self) -> list[dict[str, str]]:
        """Maps of the chosen quantity; of the levels, the pictures before and after the filter."""
        name = self.state.shadow_map
        if name != "levels":
            maps = {side: np.asarray(getattr(found, name), np.float64) for side, found in self._sides().items()}
            high = max((float(np.nanmax(values)) for values in maps.values() if np.isfinite(values).any()), default=1.0)
            return [
                {"title": f"{MAPS[name][0]}, {side}: 0 to {high:.3g}", "url": data_url(_heat(values, high))}
                for side, values in maps.items()
            ]
        if self._both is None:
            return []
        exposure = self.app.exposure
        return [
            {"title": title, "url": data_url(draw_layer(image.colour, "light", exposure=exposure), jpeg=True)}
            for title, image in (
                ("by importance, before the filter", self._both.on.unfiltered),
                ("evenly, before the filter", self._both.off.unfiltered),
                ("by importance, after the filter", self._both.on.frame.image),
                ("evenly, after the filter", self._both.off.frame.image),
            )
        ]

    def _choose(self, name: str) -> None:
        with self.state:
            self.state.shadow_map = name
            self.show()

    def _compare(self) -> None:
        frame, renderer = self.app.frame, self.app.workbench.renderer
        if frame is None:
            return

        def work(progress: Any) -> ImportanceComparison:
            with renderer.on_threads():
                return compare_importance(
                    renderer.engine, frame, PICKS, lambda share, said: progress(f"{100 * share:.0f} % {said}")
                )

        def done(both: ImportanceComparison) -> None:
            if frame is self._of:
                self._both = both
                self.show()

        self.app.run("importance", work, done)


def _heat(values: NDArray[np.float64], high: float) -> NDArray[np.uint8]:
    return draw_layer(values, "scalar", low=0.0, high=high if high > 0 else 1.0)


def _text(name: str, value: float) -> str:
    if not np.isfinite(value):
        return "-"
    if name in ("blocked", "without_ray"):
        return f"{100 * value:.1f} %"
    return f"{value:,.0f}" if name == "lights_picked" else f"{value:.3g}"
