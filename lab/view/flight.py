"""The camera of the window: where keys and mouse take it."""

from __future__ import annotations

from lab.engine.vulkan.window.inputs import Inputs
from lab.scene.fly_camera import FlyCamera
from lab.scene.scene import Camera

DEGREES_A_PIXEL = 0.15
FASTER = 4.0
NOTCH = 1.25
SLOWEST, FASTEST = 0.002, 10.0
LONGEST_STEP = 0.1
"""Seconds: a frame that took longer moves the camera as if it had taken so long, else one key would leap."""


class Flight:
    """A camera under way.

    Attributes:
        camera: what is seen. The camera that it set out from, to the last bit, until it moves.
        start: that camera.    speed: scene radii a second.

    """

    def __init__(self, camera: Camera, scene_radius: float) -> None:
        self.camera = self.start = camera
        self.speed = 0.2
        self._radius = scene_radius
        self._flown = FlyCamera.of(camera)

    def go_to(self, camera: Camera) -> None:
        """Sets out from another camera."""
        self.camera = self.start = camera
        self._flown = FlyCamera.of(camera)

    def fly(self, inputs: Inputs, seconds: float) -> None:
        """Looks and moves as `inputs` say, which were gathered over so many seconds."""
        if inputs.wheel:
            self.speed = min(FASTEST, max(SLOWEST, self.speed * NOTCH**inputs.wheel))
        held = inputs.held
        up = bool(held & {"space"}) or (inputs.looking and "e" in held)
        ways = (
            _both("w" in held, "s" in held),
            _both("d" in held, "a" in held),
            _both(up, "q" in held),
        )
        if not any(ways) and inputs.look == (0.0, 0.0):
            return
        step = self.speed * self._radius * min(seconds, LONGEST_STEP) * (FASTER if "shift" in held else 1.0)
        right, down = inputs.look
        self._flown = self._flown.turned(right * DEGREES_A_PIXEL, -down * DEGREES_A_PIXEL)
        self._flown = self._flown.moved(*(way * step for way in ways))
        self.camera = self._flown.camera()


def _both(one: bool, other: bool) -> int:
    return int(one) - int(other)
