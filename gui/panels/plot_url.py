"""Figures as addresses of images."""

from __future__ import annotations

from matplotlib.figure import Figure

from gui.layers.encode import image_url
from gui.plots import to_png


def plot_url(figure: Figure, width_px: int, height_px: int) -> str:
    """The figure as the address of an ``<img>`` of this size."""
    return image_url(to_png(figure, width_px, height_px))
