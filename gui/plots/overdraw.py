"""How many lights the pixels look at: the whole, level by level, and as the lights become more (LY19 Figure 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gui.plots.style import ACCENT, INK, QUIET, SECOND, SMALL, add_legend, describe, new_figure, say_nothing
from lab.level_colours import LEVEL_COLOURS
from lab.survey import OverdrawGrowth, OverdrawSurvey

if TYPE_CHECKING:
    from lab.survey import OverdrawGrowth, OverdrawSurvey


def overdraw_plot(survey: OverdrawSurvey, level: int | None = None) -> Figure:
    """Histogram of one level's counts, or (None) of the total, over the pixels that see a surface."""
    found = survey.total if level is None else survey.levels[level]
    if found.pixels == 0:
        return say_nothing("the view sees no surface")
    figure, axes = new_figure()
    colour = ACCENT if level is None else LEVEL_COLOURS[level]
    share = 100 * found.histogram / found.pixels
    axes.stairs(share, found.edges - 0.5, fill=True, color=colour, alpha=0.55)
    axes.stairs(share, found.edges - 0.5, color=colour, linewidth=1)
    marks = (("mean", found.mean, INK, "-"), ("median", found.median, INK, ":"), ("95 %", found.p95, SECOND, "--"))
    for name, value, ink, line in marks:
        axes.axvline(value, color=ink, linewidth=1.2, linestyle=line, label=f"{name} {value:.4g}")
    axes.plot([], [], " ", label=f"max {found.max:,}")
    axes.set_xlim(min(-0.5, float(found.edges[0]) - 0.5), float(found.edges[-1]) - 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    of = "all levels" if level is None else f"level {level}"
    describe(axes, f"{_word(survey)}, {of}", "lights a pixel", "pixels (%)")
    add_legend(axes, loc="upper right")
    return figure


def overdraw_levels_plot(survey: OverdrawSurvey) -> Figure:
    """A histogram a level, one above the other on one scale, each as high as its greatest bin; a line at the mean."""
    rows = [found for found in survey.levels if found.max > 0]
    if not rows:
        return say_nothing("no light reaches what is seen")
    figure, axes = new_figure()
    beside = axes.get_yaxis_transform()
    columns = ((1.02, "mean", INK), (1.14, "max", QUIET))
    for i, found in enumerate(rows):
        top = found.histogram / int(found.histogram.max()) * 0.84
        colour = LEVEL_COLOURS[found.level or 0]
        axes.stairs(top + i, found.edges - 0.5, baseline=i, fill=True, facecolor=colour, edgecolor=colour, alpha=0.7)
        axes.plot([found.mean, found.mean], [i, i + 0.84], color=INK, linewidth=1.2)
        for (x, _, ink), text in zip(columns, (f"{found.mean:.3g}", f"{found.max:,}"), strict=True):
            axes.text(x, i + 0.3, text, fontsize=SMALL, color=ink, va="center", transform=beside)
    for x, name, ink in columns:
        axes.text(x, len(rows), name, fontsize=SMALL, color=ink, va="bottom", transform=beside)
    axes.set_yticks(np.arange(len(rows)) + 0.3, [str(found.level) for found in rows])
    axes.set_ylim(-0.05, len(rows))
    axes.set_xlim(-0.5, 1.15 * max(found.p95 for found in rows) + 1)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(False)
    total = survey.total
    describe(axes, f"{_word(survey)}: all levels {total.mean:.4g}, at most {total.max:,}", "lights a pixel", "level")
    return figure


def growth_plot(growth: OverdrawGrowth) -> Figure:
    """Mean overdraw against the number of grid lights, and the line through the logarithm."""
    figure, axes = new_figure()
    lights = np.asarray(growth.grid_lights, np.float64)
    ends = np.geomspace(lights.min() / 1.5, lights.max() * 1.5, 50)
    line = f"{growth.intercept:.1f} {'+' if growth.slope >= 0 else '-'} {abs(growth.slope):.2f} ln(lights)"
    axes.plot(ends, growth.fitted(ends), color=SECOND, linewidth=1.4, label=f"{line}, R² = {growth.r_squared:.3f}")
    axes.plot(lights, growth.overdraw, "o", color=ACCENT, markersize=6, label="measured")
    for i, (vpls, x, y) in enumerate(zip(growth.vpls, lights, growth.overdraw, strict=True)):
        # Below and above by turns: numbers of lights may be alike.
        shift, side = ((8, -9), "left") if i % 2 == 0 else ((-8, 7), "right")
        axes.annotate(f"{_short(vpls)} VPLs", (x, y), xytext=shift, textcoords="offset points", fontsize=SMALL,
                      color=QUIET, ha=side, va="center")  # fmt: skip
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(lambda value, _: _short(value))
    axes.set_ylim(0, max(growth.overdraw) * 1.2)
    axes.margins(x=0.08)
    describe(axes, "mean overdraw as the lights become more", "grid lights of all drawn levels", "lights a pixel")
    add_legend(axes, loc="upper left")
    return figure


def _word(survey: OverdrawSurvey) -> str:
    return survey.counted.replace("_", " ")


def _short(count: float) -> str:
    for size, letter in ((1e6, "M"), (1e3, "K")):
        if count >= size:
            return f"{count / size:.3g}{letter}"
    return f"{count:.3g}"
