"""The look all plots share, and how they become files: figures of their own, no global state."""

from __future__ import annotations

import io
from typing import Any, cast

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

PAPER, INK, QUIET, GRID = "#faf9f6", "#202024", "#6c6a64", "#e4e2dc"
ACCENT, SECOND, PALE = "#3b5fc0", "#d9822b", "#c9c6bd"
"""What matters, what it is compared with, and what was before."""

WIDTH, HEIGHT, DPI = 500, 300, 100
TITLE, TEXT, SMALL = 10, 8.5, 7.5


def new_figure(rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """A figure on the page's paper, and its axes: one, or an array of them; `options` as of ``Figure.subplots``."""
    figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI, facecolor=PAPER, layout="constrained")
    axes = figure.subplots(rows, columns, **options)
    for one in [axes] if isinstance(axes, Axes) else axes.ravel():
        _calm(one)
    return figure, axes


def _calm(axes: Axes) -> None:
    axes.set_facecolor(PAPER)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(PALE)
    axes.tick_params(labelsize=TEXT, colors=QUIET, length=3, which="both", color=PALE)
    axes.grid(axis="y", color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)


def describe(axes: Axes, title: str = "", x: str = "", y: str = "") -> None:
    """Title at the left, names of the axes with their units."""
    axes.set_title(title, fontsize=TITLE, color=INK, loc="left", pad=6)
    axes.set_xlabel(x, fontsize=TEXT, color=QUIET)
    axes.set_ylabel(y, fontsize=TEXT, color=QUIET)


def add_legend(axes: Axes, **options: Any) -> None:
    """A legend without a frame."""
    axes.legend(fontsize=SMALL, frameon=False, labelcolor=INK, **options)


def say_nothing(text: str) -> Figure:
    """A figure that says why there is nothing to plot."""
    figure, axes = new_figure()
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", fontsize=TITLE, color=QUIET, transform=axes.transAxes)
    return figure


def to_png(figure: Figure, width_px: int = WIDTH, height_px: int = HEIGHT, dpi: int = DPI) -> bytes:
    """The figure as PNG of exactly this size; a greater `dpi` makes letters larger."""
    figure.set_dpi(dpi)
    # A hair more: the canvas rounds sizes down.
    figure.set_size_inches((width_px + 1e-6) / dpi, (height_px + 1e-6) / dpi)
    buffer, canvas = io.BytesIO(), cast(Any, FigureCanvasAgg(figure))
    canvas.print_png(buffer, metadata={"Software": None})
    return buffer.getvalue()


def to_svg(figure: Figure, width_px: int = WIDTH, height_px: int = HEIGHT) -> str:
    """The figure as the text of an SVG file; the same figure gives the same text."""
    figure.set_size_inches(width_px / DPI, height_px / DPI)
    buffer, canvas = io.StringIO(), cast(Any, FigureCanvasSVG(figure))
    with matplotlib.rc_context({"svg.hashsalt": "lab"}):
        canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})
    return buffer.getvalue()
