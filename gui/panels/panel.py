"""What a part of the page is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gui.inspector import Inspector

DENSE = {"density": "compact", "hide_details": True, "variant": "outlined"}
"""How fields look on this page."""


class Panel(ABC):
    """A part of the page. It draws widgets once, and then answers to what changes.

    Only the panel that is open is asked to show something: :meth:`show` must bring everything up to date from
    ``app.workbench.frame``, ``app.pixel`` and ``app.light``, and may be called at any time, before the first frame too.
    """

    def __init__(self, app: Inspector) -> None:
        self.app = app

    @property
    def state(self) -> Any:
        """The page's variables, shared with every browser that looks at it."""
        return self.app.state

    @abstractmethod
    def build(self) -> None:
        """Makes the widgets, inside the layout's current place. Called once."""

    @abstractmethod
    def show(self) -> None:
        """Brings what is shown up to date. Quick: longer work goes through ``app.run``."""

    def hide(self) -> None:  # noqa: B027 (most have nothing to hide)
        """Another panel is opened in its place."""

    def screenshot(self) -> bytes:
        """What is shown, as PNG; empty where there is nothing yet."""
        return b""

    def close(self) -> None:  # noqa: B027 (most hold nothing)
        """Frees what is held outside Python's sight."""
