"""Every panel by its name in the view state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gui.panels.leaks import LeaksPanel
from gui.panels.levels import LevelsPanel
from gui.panels.overdraw import OverdrawPanel
from gui.panels.panel import Panel
from gui.panels.picture import PicturePanel
from gui.panels.pixel import PixelPanel
from gui.panels.scene import ScenePanel
from gui.panels.shadows import ShadowsPanel
from gui.panels.timings import TimingsPanel

if TYPE_CHECKING:
    from gui.inspector import Inspector

TITLES = {
    "pixel": "Pixel",
    "overdraw": "Overdraw",
    "shadows": "Shadow samples",
    "leaks": "Leaks",
    "levels": "Levels",
    "timings": "Timings",
}
"""The panels of the lower row, in their order."""


def make_panels(app: Inspector) -> dict[str, Panel]:
    """The panels of `app`."""
    return {
        "picture": PicturePanel(app),
        "scene": ScenePanel(app),
        "pixel": PixelPanel(app),
        "overdraw": OverdrawPanel(app),
        "shadows": ShadowsPanel(app),
        "leaks": LeaksPanel(app),
        "levels": LevelsPanel(app),
        "timings": TimingsPanel(app),
    }
