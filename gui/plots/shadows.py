"""Where shadow samples go, picked by importance and evenly (LY19 Figures 7 and 8)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gui.plots.style import ACCENT, INK, SECOND, SMALL, add_legend, describe, new_figure, say_nothing
from lab.pixel_stats import pixel_stats
from lab.survey import ShadowDistribution

Distributions = Mapping[str, ShadowDistribution]
"""By name, at most two: what matters, and what it is compared with."""

_COLOURS = (ACCENT, SECOND)

MAPS = {
    "entropy": ("entropy of the picks", "bits", False),
    "effective_lights": ("effective number of lights", "lights", True),
    "blocked": ("blocked shadow rays", "share of a pixel's rays", False),
    "mean_level": ("mean level of the picks", "level", False),
}
"""Maps of a distribution: title, unit, and whether steps are ratios."""


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
    """Histogram over pixels of one of :data:`MAPS`, with the mean of each side."""
    title, unit, ratios = MAPS[name]
    values = {side: _map(found, name, ratios) for side, found in distributions.items()}
    known = [v[np.isfinite(v)] for v in values.values()]
    if not any(v.size for v in known):
        return say_nothing("nothing was picked")
    low = min(float(v.min()) for v in known if v.size)
    high = max(float(v.max()) for v in known if v.size)
    low, high = (min(low, 0.0), max(high, 1.0)) if name == "blocked" else (low, high)
    figure, axes = new_figure()
    for i, (side, found) in enumerate(values.items()):
        stats = pixel_stats(found, bins=40, low=low, high=high if high > low else low + 1)
        if stats.count == 0:
            continue
        edges = 2.0**stats.edges if ratios else stats.edges
        share = 100 * stats.counts / stats.count
        mean = distributions[side].summary()[name] if name != "blocked" else _mean(distributions[side])
        axes.stairs(share, edges, fill=True, color=_COLOURS[i], alpha=0.3)
        axes.stairs(share, edges, color=_COLOURS[i], linewidth=1.2, label=f"{side}: mean {mean:.3g}")
        axes.axvline(mean, color=_COLOURS[i], linewidth=1.2, linestyle="--")
    if ratios:
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    describe(axes, title, unit, "pixels (%)")
    add_legend(axes, loc="upper right")
    return figure


def _map(found: ShadowDistribution, name: str, ratios: bool) -> NDArray[Any]:
    values: NDArray[Any] = np.asarray(getattr(found, name), np.float64)
    return np.log2(values) if ratios else values


def _mean(found: ShadowDistribution) -> float:
    return pixel_stats(found.blocked).mean
