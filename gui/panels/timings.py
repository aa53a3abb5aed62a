"""How long each stage of the frame took; a stage whose result was taken again took nothing."""

from __future__ import annotations

from trame.widgets import html

from gui.panels.panel import Panel
from gui.plots import timings_plot, to_png
from gui.plots.timings import TAKEN_AGAIN_MS
from lab.engine.engine import STAGES
from lab.records import Frame


class TimingsPanel(Panel):
    """A bar a stage, and the total, beside the frame before."""

    _before: Frame | None = None
    _now: Frame | None = None

    def build(self) -> None:
        """One row a stage."""
        self.state.timings, self.state.timings_total = [], ""
        with html.Div(classes="lab-timings", id="timings"):
            with html.Div(classes="lab-timing", v_for="row in timings", key="row.stage"):
                html.Span("{{ row.stage }}", classes="lab-name")
                with html.Span(classes="lab-bar"):
                    html.Span(style=("'width:' + row.percent + '%'",))
                html.Span("{{ row.text }}", classes="lab-ms")
                html.Span("{{ row.before }}", classes="lab-ms lab-quiet")
            html.Div("{{ timings_total }}", classes="lab-total")

    def show(self) -> None:
        """The frame's times."""
        frame = self.app.frame
        if frame is None:
            return
        if frame is not self._now:
            self._before, self._now = self._now, frame
        before = {} if self._before is None else self._before.stages_ms
        longest = max(frame.stages_ms.values(), default=0.0) or 1.0
        self.state.timings = [
            {
                "stage": stage,
                "percent": 100 * frame.stages_ms.get(stage, 0.0) / longest,
                "text": _text(frame.stages_ms.get(stage, 0.0)),
                "before": f"before: {_text(before[stage])}" if stage in before else "",
            }
            for stage in STAGES
        ]
        self.state.timings_total = f"{frame.total_ms:.0f} ms in all"

    def screenshot(self) -> bytes:
        """The bars."""
        if self._now is None:
            return b""
        before = None if self._before is None else self._before.stages_ms
        return to_png(timings_plot(self._now.stages_ms, before), 960, 540)


def _text(milliseconds: float) -> str:
    return "taken again" if milliseconds < TAKEN_AGAIN_MS else f"{milliseconds:.1f} ms"
