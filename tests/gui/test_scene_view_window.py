"""Keys and clicks of the window, driven off-screen; and what a missing display is told."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gui.scene_view import SceneView
from gui.scene_view.window import SceneWindow, check_display
from lab import LabError

from . import scenes

SIZE = (320, 240)


@pytest.fixture(scope="module")
def window() -> Iterator[SceneWindow]:
    made = SceneWindow(SceneView(scenes.engine().scene, window_size=SIZE), scenes.frame())
    yield made
    made.close()


def send(window: SceneWindow, event: str, x: int = 0, y: int = 0, key: str = "") -> None:
    """As the window system does; (x, y) from the upper left corner."""
    iren: Any = window.view.plotter.iren
    iren.interactor.SetEventInformation(x, SIZE[1] - 1 - y, 0, 0, "\0", 0, key)
    iren.interactor.InvokeEvent(event)


def test_keys_change_what_is_shown(window: SceneWindow) -> None:
    window.press("r")
    window.press("a")
    window.press("a")
    before = window.view.screenshot()
    for key in "1vcmtb":
        send(window, "KeyPressEvent", key=key)
        after = window.view.screenshot()
        assert (after != before).any(), f"key {key} changed nothing"
        before = after
    send(window, "KeyPressEvent", key="h")
    assert (window.view.screenshot() != before).any(axis=-1).sum() > 1000, "the help is gone"
    for key in "C1vmmmthx":
        send(window, "KeyPressEvent", key=key)
    assert window.levels == set(range(scenes.frame().hierarchy.top + 1))


def test_vtk_does_nothing_of_its_own_with_keys(window: SceneWindow) -> None:
    actors = [a for a in window.view.plotter.renderer.GetViewProps() if a.IsA("vtkActor")]
    before = [actor.GetProperty().GetRepresentation() for actor in actors]
    iren: Any = window.view.plotter.iren
    for key in "wsp3ju":
        iren.interactor.SetEventInformation(10, 10, 0, 0, key, 0, key)
        iren.interactor.InvokeEvent("CharEvent")
    assert [actor.GetProperty().GetRepresentation() for actor in actors] == before


def test_a_click_selects_the_light_under_it_and_a_turn_does_not(window: SceneWindow) -> None:
    hierarchy = scenes.frame().hierarchy
    window.press("r")
    window.levels = {2}
    window.view.show_mesh("none")
    window.view.show_levels(hierarchy, {2})
    first, end = hierarchy.offset[2:4]
    pixels, depth = window.view._viewpoint.project(hierarchy.position[first:end])
    inside = (depth > 0) & (pixels > 20).all(axis=1) & (pixels < np.array(SIZE) - 20).all(axis=1)
    x, y = map(int, pixels[np.flatnonzero(inside)[0]])
    expected = window.view.pick(x, y)
    assert expected is not None and expected[0] == "light"
    send(window, "LeftButtonPressEvent", x, y)
    send(window, "LeftButtonReleaseEvent", x, y)
    assert window.selected == expected[1]

    eye = window.view.camera.eye
    send(window, "LeftButtonPressEvent", x, y)
    send(window, "MouseMoveEvent", x + 40, y + 10)
    assert window.view._mesh._moving
    send(window, "LeftButtonReleaseEvent", x + 40, y + 10)
    assert window.selected == expected[1] and window.view.camera.eye != eye
    assert window.view.camera.up == (0, 1, 0), "what is up stays up"
    send(window, "TimerEvent")
    assert not window.view._mesh._moving

    window.press("f")
    np.testing.assert_allclose(window.view.camera.target, hierarchy.position[window.selected], atol=1e-5)
    send(window, "LeftButtonPressEvent", 2, 2)
    send(window, "LeftButtonReleaseEvent", 2, 2)
    assert window.selected is None


def test_the_wheel_goes_on(window: SceneWindow) -> None:
    window.press("r")
    eye, target = np.array(window.view.camera.eye), np.array(window.view.camera.target)
    send(window, "MouseWheelForwardEvent")
    assert np.linalg.norm(np.array(window.view.camera.eye) - target) < np.linalg.norm(eye - target)
    send(window, "MouseWheelBackwardEvent")
    np.testing.assert_allclose(window.view.camera.eye, eye, atol=1e-6)
    send(window, "TimerEvent")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
@pytest.mark.parametrize(
    ("display", "message"),
    [("", "--window: there is no display here"), (":4711", "DISPLAY=:4711 cannot be opened; leave --window out")],
)
def test_a_missing_display_is_named(display: str, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", display)
    with pytest.raises(LabError, match=message):
        check_display()


def test_a_window_opens_and_closes() -> None:
    if shutil.which("xvfb-run") is None:
        missing = "xvfb-run is not installed, no window can be opened: apt-get install xvfb xauth"
        pytest.fail(missing) if os.environ.get("CI") == "true" else pytest.skip(missing)
    code = """
from tests.gui import scenes
import gui.scene_view.window as module

class Closing(module.SceneWindow):
    def __init__(self, view, frame):
        super().__init__(view, frame)
        iren = view.plotter.iren
        iren.initialize()
        iren.interactor.AddObserver("TimerEvent", lambda *_: self.finish())
        iren.interactor.CreateRepeatingTimer(400)

    def finish(self):
        self.press("1")
        print(self.view.plotter.render_window.GetClassName(), len(set(self.view.screenshot().ravel().tolist())) > 20)
        self.press("q")

module.SceneWindow = Closing
module.run_window(scenes.engine().scene, scenes.frame(), size=(320, 240))
print("closed")
"""
    environment = {key: value for key, value in os.environ.items() if key != "VTK_DEFAULT_OPENGL_WINDOW"}
    done = subprocess.run(
        ["xvfb-run", "-a", sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.split() == ["vtkXOpenGLRenderWindow", "True", "closed"]
