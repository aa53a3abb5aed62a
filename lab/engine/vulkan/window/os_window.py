"""The window that the system gives: it opens, closes, and tells what keys and mouse do."""

from __future__ import annotations

import os
import platform
from typing import TYPE_CHECKING, Any

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.window.inputs import Inputs, Press
from lab.errors import LabError

if TYPE_CHECKING:
    import slangpy as spy

_ADVICE = (
    "run it where there is a screen, or under a virtual one: xvfb-run -a lab view SCENE --frames 3 --screenshot FILE; "
    "for a picture without a window: lab render SCENE --engine vulkan"
)

_STEERS_PANEL = {"tab", "up", "down", "left", "right", "space", "home", "end", "page_up", "page_down"}
"""Keys that would walk through the panel's widgets. They are ours, unless somebody types a number there."""


class OsWindow:
    """A window on the screen.

    Attributes:
        raw: slangpy's.    panel: takes keys and mouse first, where they are over it; None as long as there is none.

    """

    def __init__(self, title: str, size: tuple[int, int]) -> None:
        """Opens it.

        Errors: :class:`LabError` where there is no display.
        """
        spy = import_slangpy()
        try:
            self.raw: Any = spy.Window(*size, title=title)
        except RuntimeError as error:
            raise LabError(f"no window can be opened{_reason(error)}; {_ADVICE}") from None
        self.panel: Any = None
        self._pressed: list[Press] = []
        self._down: set[str] = set()
        self._touched: set[str] = set()
        self._looking = self._typing = False
        self._at = (0.0, 0.0)
        self._look = (0.0, 0.0)
        self._wheel = 0.0
        self.raw.on_keyboard_event = self.on_key
        self.raw.on_mouse_event = self.on_mouse

    @property
    def open(self) -> bool:
        """Until somebody closes it."""
        return not self.raw.should_close()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels; 0 while it is minimised."""
        return int(self.raw.width), int(self.raw.height)

    def poll(self) -> Inputs:
        """What happened since the last call."""
        self.raw.process_events()
        inputs = Inputs(
            tuple(self._pressed), frozenset(self._down | self._touched), self._look, self._looking, self._wheel
        )
        self._pressed.clear()
        self._touched.clear()
        self._look, self._wheel = (0.0, 0.0), 0.0
        return inputs

    def close(self) -> None:
        """Takes it from the screen."""
        self.raw.on_keyboard_event = None
        self.raw.on_mouse_event = None
        self.panel = None
        self.raw.close()

    def on_key(self, event: spy.KeyboardEvent) -> None:
        """Hears a key."""
        key = _plain(event.key.name)
        if self.panel is not None and (self._typing or key not in _STEERS_PANEL):
            self._typing = self.panel.handle_keyboard_event(event)
        if event.is_input():
            return
        if event.is_key_release():
            self._down.discard(key)
        elif not self._typing:
            shift = event.has_modifier(import_slangpy().KeyModifier.shift)
            self._pressed.append(Press(key, shift))
            self._down.add(key)
            self._touched.add(key)

    def on_mouse(self, event: spy.MouseEvent) -> None:
        """Hears the mouse. A button that goes down over the picture looks around until it goes up."""
        used = self.panel is not None and self.panel.handle_mouse_event(event)
        at = (float(event.pos.x), float(event.pos.y))
        if event.is_button_up():
            self._look_around(False)
        elif event.is_button_down() and not used:
            self._look_around(True)
        elif event.is_move() and self._looking:
            self._look = (self._look[0] + at[0] - self._at[0], self._look[1] + at[1] - self._at[1])
        elif event.is_scroll() and not used:
            self._wheel += float(event.scroll.y)
        self._at = at

    def _look_around(self, on: bool) -> None:
        if on != self._looking:
            modes: Any = import_slangpy().CursorMode
            self.raw.cursor_mode = modes.disabled if on else modes.normal
        self._looking = on


def _plain(name: str) -> str:
    """``key1`` and ``keypad1`` as ``1``, ``left_shift`` as ``shift``; others as they are."""
    digit = name.removeprefix("keypad").removeprefix("key")
    if digit.isdecimal() and len(digit) == 1:
        return digit
    return "shift" if name in ("left_shift", "right_shift") else name


def _reason(error: RuntimeError) -> str:
    known = {name: os.environ.get(name, "") for name in ("DISPLAY", "WAYLAND_DISPLAY")}
    if platform.system() != "Linux":
        return f" ({str(error).splitlines()[0]})"
    if not any(known.values()):
        return ": there is no display here (neither DISPLAY nor WAYLAND_DISPLAY is set)"
    return ": the display can't be opened (" + ", ".join(f"{k}={v}" for k, v in known.items() if v) + ")"
