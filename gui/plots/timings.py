"""How long each stage took, beside the frame before."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from gui.plots.style import ACCENT, GRID, INK, PALE, QUIET, SMALL, TEXT, describe, new_figure
from lab.engine.engine import STAGES

TAKEN_AGAIN_MS = 0.05
"""A stage that took less was not done: its result was taken from the frame before."""


def timings_plot(stages_ms: Mapping[str, float], previous_ms: Mapping[str, float] | None = None) -> Figure:
    """A bar a stage, in the order of the frame; pale bars under them are the frame before."""
    figure, axes = new_figure()
    rows = np.arange(len(STAGES))[::-1]
    now = [stages_ms.get(stage, 0.0) for stage in STAGES]
    before = [(previous_ms or {}).get(stage, 0.0) for stage in STAGES]
    longest = max([*now, *before, 1e-3])
    if previous_ms:
        axes.barh(rows - 0.22, before, 0.22, color=PALE)
        axes.barh(rows + 0.1, now, 0.4, color=ACCENT)
    else:
        axes.barh(rows, now, 0.55, color=ACCENT)
    for row, ms in zip(rows, now, strict=True):
        again = ms < TAKEN_AGAIN_MS
        axes.text(
            ms + longest * 0.012, row + (0.1 if previous_ms else 0), "taken again" if again else f"{ms:,.1f}",
            fontsize=SMALL, color=QUIET if again else INK, va="center",
        )  # fmt: skip
    axes.set_yticks(rows, STAGES, color=INK, fontsize=TEXT)
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(0, longest * 1.14)
    axes.grid(False)
    axes.grid(axis="x", color=GRID, linewidth=0.8)
    total = f"{sum(now):,.0f} ms"
    title = f"{total} in all" + (f" (before, pale: {sum(before):,.0f} ms)" if previous_ms else "")
    describe(axes, title, "ms")
    return figure
