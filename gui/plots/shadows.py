"""Where shadow samples go, picked by importance and evenly (LY19 Figures 7 and 8)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gui.plots.style import ACCENT, INK, SECOND, SMALL, add_legend, describe, new_figure, say_nothing
from lab.errors import LabError, nearest
from lab.pixel_stats import pixel_stats
from lab.survey import ShadowDistribution

if TYPE_CHECKING:
    from lab.survey import ShadowDistribution

Distributions = Mapping[str, "ShadowDistribution"]
"""By name, at most two: what matters, and what it is compared with."""

_COLOURS = (ACCENT, SECOND)

MAPS = {
    "entropy": ("entropy of the picks", "bits"),
    "effective_lights": ("effective number of lights", "lights"),
    "blocked": ("blocked shadow rays", "share of a pixel's rays"),
    "mean_level": ("mean level of the picks", "level"),
}
"""Maps of a distribution: title and unit."""

_BINS = 40


def level_shares_plot(distributions: Distributions) -> Figure:
    """Share of all picks that fall on each level; the dark part of a bar is blocked rays' share of them."""
    figure, axes = new_figure()
    width = 0.8 / len(distributions)
    for i, (name, found) in enumerate(distributions.items()):
        x = np.arange(len(found.level_shares)) + (i - (len(distributions) - 1) / 2) * width
        shares = 100 * found.level_shares
        axes.bar(x, shares, width * 0.92, color=_COLOURS[i], alpha=0.55, label=name)
        blocked = shares * np.nan_to_num(found.level_blocked_shares)
        axes.bar(x, blocked, width * 0.92, color=_COLOURS[i])
        for at, share in zip(x, shares, strict=True):
            if share >= 0.5:
                axes.text(at, share, f"{share:.0f}", fontsize=SMALL - 0.5, color=INK, ha="center", va="bottom")
    levels = range(max(len(found.level_shares) for found in distributions.values()))
    axes.set_xticks(list(levels), [str(level) for level in levels])
    describe(axes, "where the picks go (dark: blocked)", "level", "picks (%)")
    add_legend(axes, loc="upper left")
    axes.margins(y=0.12)
    return figure


def distribution_plot(distributions: Distributions, name: str) -> Figure:
    """Histogram over pixels of one of :data:`MAPS`, with the mean of each side; numbers of lights in octaves."""
    if name not in MAPS:
        raise LabError(f"there is no map {name!r} of a distribution{nearest(name, MAPS)}; there are {', '.join(MAPS)}")
    title, unit = MAPS[name]
    octaves = name == "effective_lights"
    maps = {side: np.asarray(getattr(found, name), np.float64) for side, found in distributions.items()}
    shown = {side: np.log2(values) if octaves else values for side, values in maps.items()}
    low, high, bins = _range(name, list(shown.values()), distributions)
    figure, axes = new_figure()
    for i, (side, values) in enumerate(shown.items()):
        stats = pixel_stats(values, bins=bins, low=low, high=high)
        if stats.count == 0:
            return say_nothing("nothing was picked")
        edges = 2.0**stats.edges if octaves else stats.edges
        share, mean = 100 * stats.counts / stats.count, pixel_stats(maps[side]).mean
        axes.stairs(share, edges, fill=True, color=_COLOURS[i], alpha=0.3)
        axes.stairs(share, edges, color=_COLOURS[i], linewidth=1.2, label=f"{side}: mean {mean:.3g}")
        axes.axvline(mean, ymax=0.8, color=_COLOURS[i], linewidth=1.2, linestyle="--")
    if octaves:
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_ylim(0, axes.get_ylim()[1] * 1.28)  # room for the names
    describe(axes, title, unit, "pixels (%)")
    add_legend(axes, loc="upper left", ncols=len(shown))
    return figure


def _range(name: str, values: list[NDArray[Any]], distributions: Distributions) -> tuple[float, float, int]:
    """Ends and number of the bins. Few picks make few different shares: each gets the middle of a bin."""
    if name == "blocked":
        return -0.025, 1.025, 21
    if name == "mean_level":
        top = max(len(found.level_shares) for found in distributions.values()) - 1
        return -0.125, top + 0.125, 4 * top + 1
    stats = [pixel_stats(v) for v in values]
    low, high = min(s.minimum for s in stats), max(s.maximum for s in stats)
    return (low, high, _BINS) if high > low else (low - 0.5, low + 0.5, _BINS)
