"""How long each stage of the frame took; a stage whose result was taken again took nothing."""

from __future__ import annotations

from trame.widgets import html

from gui.panels.panel import Panel
from lab.engine.engine import STAGES


class TimingsPanel(Panel):
    """A bar a stage, and the total, beside the frame before."""

    def build(self) -> None:
        """One row a stage."""
        self.state.timings, self.state.timings_total = [], ""
        with html.Div(classes="lab-timings", id="timings"):
            with html.Div(classes="lab-timing", v_for="row in timings", key="row.stage"):
                html.Span("{{ row.stage }}", classes="lab-name")
                with html.Span(classes="lab-bar"):
                    html.Span(style=("'width:' + row.percent + '%'",))
                html.Span("{{ row.text }}", classes="lab-ms")
            html.Div("{{ timings_total }}", classes="lab-total")

    def show(self) -> None:
        """The frame's times."""
        frame = self.app.frame
        if frame is None:
            return
        longest = max(frame.stages_ms.values(), default=0.0) or 1.0
        self.state.timings = [
            {
                "stage": stage,
                "percent": 100 * frame.stages_ms.get(stage, 0.0) / longest,
                "text": _text(frame.stages_ms.get(stage, 0.0)),
            }
            for stage in STAGES
        ]
        self.state.timings_total = f"{frame.total_ms:.0f} ms in all"


def _text(milliseconds: float) -> str:
    return "taken again" if milliseconds < 0.05 else f"{milliseconds:.1f} ms"
