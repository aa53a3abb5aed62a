"""Turning and walking with the mouse: what is up stays up, and what is costly waits until the view is still."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gui.scene_view.scene_view import SceneView

_CLICK_PX = 3  # a press that is let go this near is a click, not a turn
_STEP = 1.12  # of a wheel's notch; the browser tells finer turns as parts of it


class Navigation:
    """The mouse in a :class:`SceneView`: left button turns, with shift or the middle one moves, wheel and right go on.

    While the view moves it is in its moving state; `stopped` is called each time it comes to rest, and is to call
    ``view.set_moving(False)`` and draw, at once or a little later. `clicked` gets the place of a click, in pixels from
    the upper left corner. VTK's own keys are off.
    """

    def __init__(
        self, view: SceneView, stopped: Callable[[], None], clicked: Callable[[int, int], None] | None = None
    ) -> None:
        self._view, self._stopped, self._clicked = view, stopped, clicked
        iren: Any = view.plotter.iren
        iren.enable_terrain_style(mouse_wheel_zooms=False, shift_pans=True)
        iren.clear_key_event_callbacks()
        self._interactor: Any = iren.interactor
        self._style: Any = self._interactor.GetInteractorStyle()
        self._pressed: tuple[int, int] | None = None
        # Buttons are watched at the style, which keeps them to itself while it turns the view.
        watched = (
            (self._style, "CharEvent", lambda *_: None),
            (self._style, "StartInteractionEvent", lambda *_: view.set_moving(True)),
            (self._style, "EndInteractionEvent", lambda *_: stopped()),
            (self._interactor, "MouseWheelForwardEvent", lambda *_: self._go(1)),
            (self._interactor, "MouseWheelBackwardEvent", lambda *_: self._go(-1)),
            (self._style, "LeftButtonPressEvent", self._press),
            (self._style, "LeftButtonReleaseEvent", self._release),
        )
        self._observers = [(source, source.AddObserver(event, call)) for source, event, call in watched]

    def close(self) -> None:
        """Listens no more."""
        for source, observer in self._observers:
            source.RemoveObserver(observer)
        self._observers.clear()

    def _go(self, notches: float) -> None:
        self._view.set_moving(True)
        self._view.plotter.camera.Dolly(_STEP ** (notches * self._style.GetMouseWheelMotionFactor()))
        self._view.render()
        self._stopped()

    def _press(self, *_: object) -> None:
        self._pressed = self._interactor.GetEventPosition()

    def _release(self, *_: object) -> None:
        x, y = self._interactor.GetEventPosition()
        if self._pressed is None or self._clicked is None:
            return
        if max(abs(x - self._pressed[0]), abs(y - self._pressed[1])) <= _CLICK_PX:
            height = self._view.plotter.renderer.GetRenderWindow().GetSize()[1]
            self._clicked(x, height - 1 - y)
        self._pressed = None
