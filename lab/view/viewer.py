"""The state of the window: camera, settings, layer and switches, and what keys and panel do to them."""

from __future__ import annotations

from lab.engine.vulkan.window.inputs import Inputs, Press
from lab.engine.vulkan.window.panel_state import PanelState
from lab.params import Value
from lab.scene.fly_camera import camera_argument, camera_toml
from lab.scene.scene import Camera, Scene
from lab.view.flight import FASTEST, SLOWEST, Flight
from lab.view.keys import key_lines
from lab.view.settings import ViewSettings
from lab.view.shown_layer import ShownLayer

EVERY_FRAME = "go on rendering while nothing changes"
REGENERATE, NEW_NOISE = "new lights every frame", "new shadow samples every frame"
"""Switches of the view."""


class Viewer:
    """What is shown, and how. It knows no window and no device.

    Attributes:
        settings, layer, flight: see their classes.    exposure: factor on light; None: nobody has chosen one yet.
        options: switches by name.    help: whether the keys are told.    running: until somebody ends it.
        wanted: what the loop is to do: ``save`` the picture, ``fit`` the exposure, ``panel``: hide or show it.
        said: lines for the terminal.

    """

    def __init__(self, scene: Scene, settings: ViewSettings, scene_radius: float, *, regenerate: bool = False) -> None:
        self.scene, self.settings, self.layer = scene, settings, ShownLayer()
        self.flight = Flight(scene.camera(), scene_radius)
        self.exposure: float | None = scene.exposure
        self.options = {EVERY_FRAME: True, REGENERATE: regenerate, NEW_NOISE: False}
        self.help = False
        self.running = True
        self.wanted: set[str] = set()
        self.said: list[str] = []
        self._camera_name = scene.camera().name

    def step(self, inputs: Inputs, seconds: float) -> None:
        """Takes what a person did in the last `seconds`."""
        for press in inputs.pressed:
            self._take(press, looking=inputs.looking)
        self.flight.fly(inputs, seconds)
        if self.options[NEW_NOISE]:
            self.settings.next_frame()

    def panel_state(self, times: tuple[str, ...], lights: tuple[str, ...], scale: str) -> PanelState:
        """What the panel shows of it."""
        settings = self.settings
        return PanelState(
            params=settings.params,
            usual=settings.usual,
            preset=settings.preset,
            layers=self.layer.names,
            layer=self.layer.name,
            exposure=self.exposure or 1.0,
            scale=scale,
            camera=self._camera_name,
            cameras=tuple(camera.name for camera in self.scene.cameras),
            speed=self.flight.speed,
            options=dict(self.options),
            times=times,
            lights=lights,
            keys=key_lines() if self.help else (),
            message=settings.message,
        )

    # --- what the panel asks for ------------------------------------------------------------------

    def set(self, name: str, value: Value) -> None:
        """Changes a setting."""
        self.settings.set(name, value)

    def choose_preset(self, name: str) -> None:
        """Starts from a preset."""
        self.settings.choose_preset(name)

    def reset(self, names: tuple[str, ...]) -> None:
        """These settings as the preset has them."""
        self.settings.reset(names)

    def choose_layer(self, name: str) -> None:
        """Shows another layer."""
        self.layer.choose(name)

    def choose_camera(self, name: str) -> None:
        """Goes to a camera of the scene."""
        self._camera_name = name
        self.flight.go_to(self.scene.camera(name))

    def set_exposure(self, exposure: float) -> None:
        """Makes light brighter or darker."""
        self.exposure = exposure

    def set_speed(self, radii: float) -> None:
        """Flies faster or slower."""
        self.flight.speed = min(FASTEST, max(SLOWEST, radii))

    def set_option(self, name: str, on: bool) -> None:
        """Turns a switch of the view."""
        self.options[name] = on

    def press(self, key: str) -> None:
        """As the key would."""
        self._take(Press(key), looking=False)

    def _take(self, press: Press, *, looking: bool) -> None:
        key = press.key
        if self.layer.press(key):
            return
        if key == "escape":
            self.running = False
        elif key == "r":
            self.flight.go_to(self.flight.start)
        elif key == "h":
            self.help = not self.help
        elif key == "p":
            self.said.append(camera_lines(self.flight.camera))
        elif key == "e" and not looking:
            self.exposure = (self.exposure or 1.0) * 2 ** (-0.5 if press.shift else 0.5)
        elif key in ("f", "f12", "tab"):
            self.wanted.add({"f": "fit", "f12": "save", "tab": "panel"}[key])


def camera_lines(camera: Camera) -> str:
    """`camera` as flag and as block of a scene's file."""
    return f"--camera {camera_argument(camera)}\n\n{camera_toml(camera)}\n"
