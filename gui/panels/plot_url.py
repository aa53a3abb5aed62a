"""Figures as addresses of images."""

from __future__ import annotations

import base64

from matplotlib.figure import Figure

from gui.plots import to_png


def plot_url(figure: Figure, width_px: int, height_px: int) -> str:
    """The figure as the address of an ``<img>`` of this size."""
    return png_url(to_png(figure, width_px, height_px))


def png_url(png: bytes) -> str:
    """A PNG as the address of an ``<img>``; "" of nothing."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}" if png else ""
