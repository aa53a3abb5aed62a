"""Plots of the inspector: records in, matplotlib figures out. Nothing is shown, nothing global is touched."""

from gui.plots.blending import blend_plot
from gui.plots.levels import levels_plot
from gui.plots.overdraw import growth_plot, overdraw_levels_plot, overdraw_plot
from gui.plots.picks import picks_plot
from gui.plots.shadows import distribution_plot, level_shares_plot
from gui.plots.style import to_png, to_svg
from gui.plots.timings import timings_plot

__all__ = [
    "blend_plot",
    "distribution_plot",
    "growth_plot",
    "level_shares_plot",
    "levels_plot",
    "overdraw_levels_plot",
    "overdraw_plot",
    "picks_plot",
    "timings_plot",
    "to_png",
    "to_svg",
]
