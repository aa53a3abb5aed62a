"""A camera that flies: where it is, where it looks, and how keys and mouse change that."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lab.scene.scene import Camera, Vec3

Array = NDArray[np.float64]

STEEPEST = math.radians(89)
"""Looking up and down ends here: straight up there is no right and left."""


@dataclass(frozen=True)
class FlyCamera:
    """A place and a direction, told by two angles about a fixed "up".

    Attributes:
        eye: where it is.    up: unit vector; the horizon is at right angles to it.
        heading: radians about `up`, counter-clockwise seen from above.    pitch: radians above the horizon.
        fov_y_deg: full vertical angle of view.    reach: distance from the eye to the target of :meth:`camera`.

    """

    eye: Vec3
    up: Vec3
    heading: float
    pitch: float
    fov_y_deg: float = 45.0
    reach: float = 1.0

    @classmethod
    def of(cls, camera: Camera) -> FlyCamera:
        """One that sees what `camera` sees, but for a roll about the view's axis where its `up` tells nothing else."""
        up = _unit(np.asarray(camera.up, np.float64))
        way = np.subtract(camera.target, camera.eye).astype(np.float64)
        ahead, left = _horizon(up)
        direction = _unit(way)
        heading = math.atan2(float(direction @ left), float(direction @ ahead))
        pitch = math.asin(max(-1.0, min(1.0, float(direction @ up))))
        return cls(_vec3(camera.eye), _vec3(up), heading, pitch, camera.fov_y_deg, float(np.linalg.norm(way)))

    @property
    def forward(self) -> Vec3:
        """Unit vector of the view."""
        return _vec3(self._level() * math.cos(self.pitch) + np.asarray(self.up) * math.sin(self.pitch))

    @property
    def right(self) -> Vec3:
        """Unit vector to the right, along the horizon."""
        return _vec3(np.cross(self._level(), self.up))

    def camera(self, name: str = "flown") -> Camera:
        """What it sees now."""
        target = np.asarray(self.eye) + np.asarray(self.forward) * self.reach
        return Camera(name, self.eye, _vec3(target), self.up, self.fov_y_deg)

    def turned(self, right_deg: float, up_deg: float) -> FlyCamera:
        """Turned to the right along the horizon, and up, no further than :data:`STEEPEST`."""
        heading = math.remainder(self.heading - math.radians(right_deg), 2 * math.pi)
        pitch = max(-STEEPEST, min(STEEPEST, self.pitch + math.radians(up_deg)))
        return replace(self, heading=heading, pitch=pitch)

    def moved(self, forward: float, right: float, up: float) -> FlyCamera:
        """Moved by these distances: along the view, to the right, and along `up`."""
        way = np.asarray(self.forward) * forward + np.asarray(self.right) * right + np.asarray(self.up) * up
        return replace(self, eye=_vec3(np.asarray(self.eye) + way))

    def _level(self) -> Array:
        ahead, left = _horizon(np.asarray(self.up))
        return ahead * math.cos(self.heading) + left * math.sin(self.heading)


def camera_argument(camera: Camera) -> str:
    """`camera` as ``--camera`` takes it: eye:target:up:angle."""
    vectors = (",".join(map(_short, vector)) for vector in (camera.eye, camera.target, camera.up))
    return ":".join([*vectors, _short(camera.fov_y_deg)])


def camera_toml(camera: Camera) -> str:
    """`camera` as a block of a ``scene.toml``."""
    lines = [f"{key} = [{', '.join(map(_short, getattr(camera, key)))}]" for key in ("eye", "target", "up")]
    return "\n".join(["[[camera]]", f'name = "{camera.name}"', *lines, f"fov_y_deg = {_short(camera.fov_y_deg)}"])


def _horizon(up: Array) -> tuple[Array, Array]:
    """Unit vectors of headings 0 and 90 degrees."""
    axis = np.eye(3)[int(np.argmin(np.abs(up)))]
    ahead = _unit(axis - up * float(axis @ up))
    return ahead, np.cross(up, ahead)


def _unit(vector: Array) -> Array:
    return vector / float(np.linalg.norm(vector))


def _vec3(values: Array | Vec3) -> Vec3:
    return (float(values[0]), float(values[1]), float(values[2]))


def _short(value: float) -> str:
    """Six digits: a place in a scene to a millionth of its size. Without a minus before 0."""
    return f"{round(value, 12) + 0.0:.6g}"
