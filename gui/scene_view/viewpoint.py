"""Where the view is seen from: VTK's camera set, moved and asked for its projection."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gui.scene_view.pixel import camera_axes
from lab.scene.scene import Camera

Array = NDArray[np.float64]

_NEAREST = 1e-3  # the near plane, as a share of the far one: closer cuts into rooms less, but surfaces flicker


class Viewpoint:
    """VTK's camera of one renderer. Pixels are counted from the upper left corner of the window."""

    def __init__(self, renderer: Any) -> None:
        self._renderer = renderer
        renderer.SetNearClippingPlaneTolerance(_NEAREST)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the window in pixels."""
        width, height = self._renderer.GetRenderWindow().GetSize()
        return int(width), int(height)

    @property
    def camera(self) -> Camera:
        """The camera as lab's; its name is ``view``."""
        vtk = self._renderer.GetActiveCamera()
        return Camera("view", vtk.GetPosition(), vtk.GetFocalPoint(), vtk.GetViewUp(), vtk.GetViewAngle())

    @camera.setter
    def camera(self, camera: Camera) -> None:
        vtk = self._renderer.GetActiveCamera()
        vtk.ParallelProjectionOff()
        vtk.SetUseHorizontalViewAngle(False)
        vtk.SetWindowCenter(0, 0)
        vtk.SetPosition(*map(float, camera.eye))
        vtk.SetFocalPoint(*map(float, camera.target))
        vtk.SetViewUp(*map(float, camera.up))
        vtk.SetViewAngle(float(camera.fov_y_deg))
        self.fit_planes()

    def fit_planes(self) -> None:
        """Moves the near and the far plane around what is shown."""
        self._renderer.ResetCameraClippingRange()

    @property
    def pixel_angle(self) -> float:
        """Tangent of the angle between neighbouring pixels in the middle."""
        return 2 * math.tan(math.radians(self.camera.fov_y_deg) / 2) / self.size[1]

    def rays(self, pixels: ArrayLike) -> tuple[Array, Array]:
        """The eye (3,) and unit directions (n, 3) through the (n, 2) places x, y in the window."""
        camera, (width, height) = self.camera, self.size
        right, up, ahead = camera_axes(camera)
        half = math.tan(math.radians(camera.fov_y_deg) / 2)
        x, y = np.asarray(pixels, np.float64).T
        across = (2 * x - width) / height * half
        above = (1 - 2 * y / height) * half
        directions = ahead + across[:, None] * right + above[:, None] * up
        return np.asarray(camera.eye, np.float64), directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def project(self, points: ArrayLike) -> tuple[Array, Array]:
        """Of (n, 3) points the (n, 2) places x, y in the window and the (n,) depths; behind the eye a depth <= 0."""
        camera, (width, height) = self.camera, self.size
        local = (np.asarray(points, np.float64) - camera.eye) @ camera_axes(camera).T
        depth = local[:, 2]
        scale = height / 2 / math.tan(math.radians(camera.fov_y_deg) / 2) / np.where(depth > 0, depth, 1)
        return np.stack([width / 2 + local[:, 0] * scale, height / 2 - local[:, 1] * scale], axis=1), depth

    def places_around(self, target: ArrayLike, distance: float) -> Array:
        """(n, 3) eyes at `distance` from `target`: the present direction first, then others, the more turned the later.

        All look level or down, at most steeply.
        """
        centre = np.asarray(target, np.float64)
        camera = self.camera
        ahead, up = camera_axes(camera)[2], np.asarray(camera.up) / np.linalg.norm(camera.up)
        flat = ahead - (ahead @ up) * up
        if np.linalg.norm(flat) < 1e-6:
            flat = camera_axes(camera)[1]
        flat /= np.linalg.norm(flat)
        side = np.cross(flat, up)
        turns = np.radians([0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180])
        pitches = np.radians([12, 35, 60])
        ways = [math.cos(t) * flat + math.sin(t) * side for t in turns]
        directions = [ahead, *(math.cos(p) * way - math.sin(p) * up for way in ways for p in pitches)]
        return centre - distance * np.stack(directions)
