"""Picks of one pixel drawn many times, against the probabilities they should have."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gui.plots.style import INK, PALE, SMALL, add_legend, describe, new_figure, say_nothing
from lab.level_colours import LEVEL_COLOURS

if TYPE_CHECKING:
    from lab.pixel import PickTrials

_MOST_BARS = 36


def picks_plot(trials: PickTrials) -> Figure:
    """A bar a light: how often it was picked; a mark where its probability says, with two standard deviations.

    The likeliest lights stand first; what does not fit is one grey bar.
    """
    if trials.draws == 0:
        return say_nothing("no light reaches this pixel: nothing to pick")
    order = np.argsort(-trials.probability, kind="stable")
    shown = order[:_MOST_BARS]
    rest = order[_MOST_BARS:]
    counts, p = list(trials.count[shown]), list(trials.probability[shown])
    colours = [LEVEL_COLOURS[int(level)] for level in trials.level[shown]]
    if len(rest):
        counts, p, colours = [*counts, trials.count[rest].sum()], [*p, trials.probability[rest].sum()], [*colours, PALE]
    expected = trials.draws * np.array(p)
    spread = 2 * np.sqrt(np.maximum(expected * (1 - np.array(p)), 0))

    figure, axes = new_figure()
    x = np.arange(len(counts), dtype=float)
    x[len(shown) :] += 0.6
    axes.bar(x, counts, width=0.78, color=colours)
    axes.errorbar(x, expected, yerr=spread, fmt="_", color=INK, markersize=7, linewidth=1, capsize=0)
    axes.set_xticks([])
    axes.set_xlim(-0.8, x[-1] + 0.8)
    axes.margins(y=0.12)
    if len(rest):
        many = "light" if len(rest) == 1 else "lights"
        top = max(counts[-1], expected[-1] + spread[-1])
        axes.text(x[-1], top, f"{len(rest)} more\n{many} ", color=INK, fontsize=SMALL, ha="right", va="bottom")
    title = f"{trials.draws:,} picks: chi-square {trials.statistic:.1f}, {trials.freedom} dof, p = {_p(trials.p_value)}"
    describe(axes, title, f"{len(order)} lights, the likeliest first", "picks")
    levels = sorted({int(level) for level in trials.level[shown]})
    handles = [Patch(color=LEVEL_COLOURS[level], label=f"level {level}") for level in levels]
    handles.append(axes.errorbar([], [], yerr=[], fmt="_", color=INK, label="expected, 2 sigma"))
    add_legend(axes, handles=handles, loc="upper right")
    return figure


def _p(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.2g}"
