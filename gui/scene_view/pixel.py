"""What belongs to a pixel or a camera: shadow rays, the lights that light a pixel, and the cone of sight."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gui.scene_view.actors import Part, lines_actor, points_actor
from gui.scene_view.clouds import CloudPart
from gui.scene_view.colours import BLOCKED, CAMERA, FREE, NORMAL, SELECTED, Rgb, hues
from gui.scene_view.legend import Block
from lab import LabError
from lab.colour import luminance
from lab.records import as_rows
from lab.scene.scene import Camera


class RaysPart(Part):
    """The shadow rays of a pixel, the point they leave and its normal."""

    def show(
        self,
        point: ArrayLike,
        targets: ArrayLike,
        visible: ArrayLike,
        *,
        picks: ArrayLike | None,
        normal: ArrayLike | None,
        normal_length: float,
    ) -> None:
        """Rays from `point` (3,) to `targets` (n, 3), free where `visible` (n,).

        `picks`: (n,) merged indices, negative where nothing was picked: no ray then.
        """
        self.clear()
        start = as_rows("point", np.asarray(point)[None], 3)
        ends = as_rows("targets", np.asarray(targets, np.float32).reshape(-1, 3), 3)
        free = np.asarray(visible, bool).ravel()
        if len(free) != len(ends):
            raise LabError(f"rays: {len(ends)} targets and {len(free)} visibilities must agree")
        traced = np.ones(len(ends), bool) if picks is None else np.asarray(picks).ravel() >= 0
        self.add(points_actor(start, SELECTED, 9, spheres=False, through=True))
        rows: list[tuple[Rgb | None, str]] = [(SELECTED, "the pixel's point")]
        if normal is not None:
            tip = start + normal_length * as_rows("normal", np.asarray(normal)[None], 3)
            self.add(lines_actor(np.stack([start, tip], axis=1), NORMAL, 3))
            rows.append((NORMAL, "its normal"))
        for colour, which, name in ((FREE, traced & free, "free"), (BLOCKED, traced & ~free, "blocked")):
            rows.append((colour, f"{name}: {int(which.sum()):,}"))
            if which.any():
                rays = np.stack([np.broadcast_to(start, ends[which].shape), ends[which]], axis=1)
                self.add(lines_actor(rays, colour, 2))
                self.add(lines_actor(rays, colour, 2, through=True))
                self.add(points_actor(ends[which], colour, 8))
        self.legend = Block("shadow rays", rows)


class PixelLightsPart(CloudPart):
    """The grid lights that light a pixel, sized by what they send it."""

    def show_probe(self, probe: Any | None) -> None:
        """`probe`: its ``lights`` have position (n, 3) and contribution (n, 3); None: nothing."""
        self.clear()
        if probe is None:
            return
        contribution = np.asarray(probe.lights.contribution, np.float64).reshape(-1, 3)
        position = np.asarray(probe.lights.position, np.float32).reshape(-1, 3)
        self.legend = Block(
            "lights of the pixel, larger = sends more", [(None, f"{len(position):,}, in the hue of their light")]
        )
        if not len(position):
            return
        sent = luminance(contribution)
        weight = np.sqrt(sent / max(float(sent.max()), 1e-30))
        self.show(position, hues(contribution, 0.4 + 0.6 * weight), weight)


class FrustumPart(Part):
    """A camera's cone of sight."""

    def show(self, camera: Camera | None, size: tuple[int, int], length: float) -> None:
        """`size`: (width, height) of its picture in pixels; `length`: how far the cone is drawn."""
        self.clear()
        if camera is None:
            return
        eye, (right, up, ahead) = np.asarray(camera.eye, np.float64), camera_axes(camera)
        half = np.tan(np.radians(camera.fov_y_deg) / 2)
        wide = half * size[0] / size[1]
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        corners = np.array([eye + length * (ahead + x * wide * right + y * half * up) for x, y in signs])
        mark = np.array([corners[3], corners[2], eye + length * (ahead + 1.35 * half * up)])  # which side is up
        ends = [(eye, corner) for corner in corners]
        ends += list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
        ends += [(mark[0], mark[2]), (mark[1], mark[2])]
        self.add(lines_actor(np.array(ends), CAMERA, 1.5))
        self.add(points_actor(eye[None].astype(np.float32), CAMERA, 9))
        self.legend = Block("camera", [(CAMERA, f"{camera.name}, {size[0]} x {size[1]}")])


def camera_axes(camera: Camera) -> NDArray[np.float64]:
    """Unit vectors to the right, up and ahead, (3, 3)."""
    ahead = np.subtract(camera.target, camera.eye).astype(np.float64)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, camera.up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, ahead), ahead])
