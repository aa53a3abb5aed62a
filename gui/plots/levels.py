"""The levels beside each other: lights, flux, and how many of them a pixel looks at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from gui.layers.read_out import number_text
from gui.plots.style import INK, SMALL, describe, new_figure
from lab.colour import luminance
from lab.level_colours import LEVEL_COLOURS


def levels_plot(rows: Sequence[dict[str, Any]]) -> Figure:
    """`rows` as of :func:`lab.report.level_records`: a row a level, the finest at the foot; lights in decades."""
    columns = (
        ("lights", [float(row["grid_lights"]) for row in rows], True),
        ("flux\nluminance", [float(luminance(row["flux"])) for row in rows], False),
        ("overdraw\nmean", [float(row["overdraw_mean"]) for row in rows], False),
        ("lights used\nmean", [float(row["lights_used_mean"]) for row in rows], False),
    )
    figure, all_axes = new_figure(1, len(columns), sharey=True)
    levels = [int(row["level"]) for row in rows]
    for axes, (title, values, logarithmic) in zip(all_axes, columns, strict=True):
        axes.barh(levels, values, 0.66, color=[LEVEL_COLOURS[level] for level in levels])
        largest = max([*values, 1e-30])
        if logarithmic:
            axes.set_xscale("log")
            axes.set_xlim(0.5, largest**1.5 * 2)
        else:
            axes.set_xlim(0, largest * 1.75)
        for level, value in zip(levels, values, strict=True):
            text = f" {value:,.0f}" if logarithmic else f" {number_text(float(f'{value:.3g}'))}"
            axes.text(max(value, 0.5 if logarithmic else 0), level, text, fontsize=SMALL, color=INK, va="center")
        axes.set_xticks([])
        axes.minorticks_off()
        axes.grid(False)
        axes.spines["bottom"].set_visible(False)
        axes.set_title(title, fontsize=SMALL + 0.5, color=INK, loc="left")
        axes.tick_params(axis="y", length=0)
        axes.set_yticks(levels)
    describe(all_axes[0], y="level")
    all_axes[0].set_title("lights\n", fontsize=SMALL + 0.5, color=INK, loc="left")
    return figure
