"""What the browser is served: the style sheet and the picture's component."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from trame_client.widgets.core import AbstractElement

FOLDER = Path(__file__).parent
STYLE = FOLDER / "style.css"

serve = {"lab_inspector": str(FOLDER)}
scripts = ["lab_inspector/picture.js"]
vue_use = ["labInspector"]
"""What trame's ``server.enable_module`` looks for in a module."""


class Picture(AbstractElement):  # type: ignore[misc]
    """The component of picture.js: its properties and events, as that file has them."""

    def __init__(self, **settings: Any) -> None:
        super().__init__("lab-picture", **settings)
        self._attr_names += [
            "a", "b", ("title_a", "titleA"), ("title_b", "titleB"), "wipe", "zoom", "centre", "size", "pixel", "marks",
        ]  # fmt: skip
        self._event_names += ["view", ("wipe_to", "wipeTo"), ("pixel_at", "pixelAt"), "hover", "action"]
