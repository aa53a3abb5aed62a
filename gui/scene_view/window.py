"""The 3D view in a window of the desktop, with keys."""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any

from gui.scene_view.legend import Block, Legend
from gui.scene_view.levels import COLOUR_BY
from gui.scene_view.mesh import STYLES
from gui.scene_view.navigation import Navigation
from gui.scene_view.scene_view import SceneView
from lab import LabError
from lab.pixel.members import member_shares
from lab.records import Frame
from lab.scene.scene import Scene

_STILL_MS = 200  # of rest, after which everything is drawn

_HELP = (
    ("0 ... 9", "level on or off"),
    ("a", "all levels, or none"),
    ("b", "levels by flux, level, deviation"),
    ("v", "input lights"),
    ("c, C", "cells of the next, the previous level"),
    ("m", "mesh: textured, grey, albedo, none"),
    ("t", "mesh seen through, or opaque"),
    ("click", "select a grid light, or none"),
    ("f", "fly to the selected light"),
    ("r", "back to the scene's camera"),
    ("h", "this help"),
    ("q", "close"),
    ("left", "turn (with shift: move)"),
    ("wheel", "go on, go back"),
)


class SceneWindow:
    """What keys and clicks do to a view of `frame`.

    Attributes:
        view: the view.
        levels: the levels shown.
        selected: merged index of the selected light, or None.
    """

    def __init__(self, view: SceneView, frame: Frame) -> None:
        self.view, self._frame = view, frame
        self.levels: set[int] = {max(0, frame.hierarchy.top - 3)}
        self.selected: int | None = None
        self._style, self._colour_by, self._cells, self._seen_through, self._vpls = 0, 0, 0, False, False
        self._help = Legend(view.plotter.renderer, upper=True)
        self._help_shown = False
        self._timer: int | None = None
        self._navigation = Navigation(view, self._stopped, self.click)
        iren: Any = view.plotter.iren
        self._interactor = iren.interactor
        self._observers = [
            self._interactor.AddObserver("KeyPressEvent", lambda *_: self.press(self._interactor.GetKeySym())),
            self._interactor.AddObserver("TimerEvent", lambda *_: self._still()),
        ]
        view.look_from(frame.camera)
        self._show_mesh()
        self._show_levels()
        self.press("h")

    def close(self) -> None:
        """Listens no more, and frees the view."""
        self._navigation.close()
        for observer in self._observers:
            self._interactor.RemoveObserver(observer)
        self._help.clear()
        self.view.close()

    def press(self, key: str) -> None:
        """Does what `key`, by its X name, stands for; other keys do nothing."""
        hierarchy = self._frame.hierarchy
        if key.isdecimal() and len(key) == 1 and int(key) <= hierarchy.top:
            self.levels ^= {int(key)}
            self._show_levels()
        elif key == "a":
            self.levels = set() if self.levels else set(range(hierarchy.top + 1))
            self._show_levels()
        elif key == "b":
            self._colour_by = (self._colour_by + 1) % len(COLOUR_BY)
            self._show_levels()
        elif key == "v":
            self._vpls = not self._vpls
            self.view.show_vpls(self._frame.lights if self._vpls else None)
        elif key in {"c", "C"}:
            self._cells = (self._cells + (1 if key == "c" else -1)) % (hierarchy.top + 1)
            self.view.show_cells(hierarchy, self._cells or None)
        elif key == "m":
            self._style = (self._style + 1) % len(STYLES)
            self._show_mesh()
        elif key == "t":
            self._seen_through = not self._seen_through
            self._show_mesh()
        elif key == "f" and self.selected is not None:
            self.view.fly_to(self.selected)
        elif key == "r":
            self.view.look_from(self._frame.camera)
        elif key == "h":
            self._help_shown = not self._help_shown
            rows = [(None, f"{keys}\t{what}") for keys, what in _HELP]
            self._help.show([Block("keys", rows)] if self._help_shown else [], self.view.size[1])
        elif key == "q":
            self._interactor.TerminateApp()
            return
        else:
            return
        self.view.render()

    def click(self, x: int, y: int) -> None:
        """Selects the grid light under a place, in pixels from the upper left corner; where there is none, none."""
        picked = self.view.pick(x, y)
        self.selected = picked[1] if picked is not None and picked[0] == "light" else None
        members = None
        if self.selected is not None:
            members = member_shares(self._frame.hierarchy, self.selected, self._frame.params)
        self.view.select_light(self._frame.hierarchy, self.selected, self._frame.params, members)
        self.view.render()

    def _show_levels(self) -> None:
        self.view.show_levels(self._frame.hierarchy, self.levels, COLOUR_BY[self._colour_by])

    def _show_mesh(self) -> None:
        self.view.show_mesh(STYLES[self._style], 0.3 if self._seen_through else 1.0)

    def _stopped(self) -> None:
        """Draws everything again, once the view has rested: not after each notch of a wheel."""
        if self._timer is not None:
            self._interactor.DestroyTimer(self._timer)
        self._timer = self._interactor.CreateOneShotTimer(_STILL_MS)

    def _still(self) -> None:
        self._timer = None
        self.view.set_moving(False)
        self.view.render()


def run_window(scene: Scene, frame: Frame, *, size: tuple[int, int] = (1280, 800)) -> None:
    """Opens a window on `frame` of `scene` and returns when it is closed.

    Errors: :class:`lab.LabError` where there is no display.
    """
    check_display()
    view = SceneView(scene, off_screen=False, window_size=size)
    window = SceneWindow(view, frame)
    try:
        view.plotter.show(title=f"{scene.name} - many-lights laboratory", auto_close=False)
    finally:
        window.close()


def check_display() -> None:
    """Raises :class:`lab.LabError` where no window can be opened: VTK would end the process."""
    if sys.platform != "linux":
        return
    name = os.environ.get("DISPLAY", "")
    advice = "leave --window out to see it in a browser, or run it where there is a screen (or under xvfb-run)"
    if not name:
        raise LabError(f"--window: there is no display here (DISPLAY is not set); {advice}")
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        raise LabError(f"--window: libX11 is not installed; {advice}") from None
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        raise LabError(f"--window: the display DISPLAY={name} cannot be opened; {advice}")
    x11.XCloseDisplay(display)
