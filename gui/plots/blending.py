"""Blend weights of the levels over distance, with a pixel's lights on the curves (LY19 Figure 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from gui.plots.style import INK, PAPER, SMALL, describe, new_figure
from lab.blend_curves import blend_radii, blend_weights, drawn_levels
from lab.level_colours import LEVEL_COLOURS
from lab.params import Params
from lab.records import Hierarchy

if TYPE_CHECKING:
    from lab.pixel import Probe

_POINTS = 400
_LARGEST_MARK = 260.0


def blend_plot(params: Params, hierarchy: Hierarchy, probe: Probe | None = None) -> Figure:
    """B_l(d) of every level drawn; with `probe`, each light that lights the pixel at its distance and blend weight.

    A mark's area is the light's share of the pixel's unshadowed light.
    """
    levels = drawn_levels(hierarchy, params)
    radii = blend_radii(hierarchy, params)
    near, far = float(radii[levels[0]]) / 3, float(radii[levels[-1]]) * 2
    lights = None if probe is None or len(probe.lights) == 0 else probe.lights
    if lights is not None:
        near = min(near, max(float(lights.distance.min()) * 0.8, near / 8))
        far = max(far, float(lights.distance.max()) * 1.2)
    distance = np.geomspace(near, far, _POINTS)
    # The ramps bend at these distances exactly.
    distance = np.unique(np.concatenate([distance, *(r * radii for r in (0.5, 1.0, 2.0))]))
    distance = distance[(distance >= near) & (distance <= far)]
    weights = blend_weights(hierarchy, params, distance)

    figure, axes = new_figure()
    for level in levels:
        colour = LEVEL_COLOURS[level]
        axes.plot(distance, weights[level], color=colour, linewidth=1.6)
        x = max(float(radii[level]) * (0.6 if level == levels[0] else 1), near * 1.1)
        axes.text(x, 1.03, f"{level}", color=colour, fontsize=SMALL + 1, ha="center", fontweight="bold")
    said = "no light" if probe is not None else "the levels"
    if lights is not None:
        inside = lights.distance >= near
        said = f"{len(lights)} lights" if inside.all() else f"{len(lights)} lights, {int((~inside).sum())} nearer"
        axes.scatter(
            lights.distance, lights.blend_weight, s=14 + _LARGEST_MARK * lights.share,
            c=[LEVEL_COLOURS[int(level)] for level in lights.level], edgecolors=PAPER, linewidths=0.7, zorder=3,
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xlim(near, far)
    axes.set_ylim(0, 1.12)
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1], ["0", "", "0.5", "", "1"])
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.minorticks_off()
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    title = f"pixel ({probe.x}, {probe.y}): {said}" if probe is not None else "blending of the levels"
    note = "; area of marks: share of light" if lights is not None else ""
    describe(axes, title, f"distance (scene units){note}", "blend weight B")
    axes.text(near, 1.03, " level", color=INK, fontsize=SMALL, ha="left")
    return figure
