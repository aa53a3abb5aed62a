"""The automatic camera: all of an object, the length of a room, the open side of a box."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.scene.load import load_scene

from .scene_files import Gltf


def box(gltf: Gltf, low: tuple[float, ...], high: tuple[float, ...], inward: bool = False) -> None:
    """A box of 12 triangles, seen from outside or from within."""
    p = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)], dtype=np.float32)
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))], dtype=np.uint16)
    gltf.node(mesh=gltf.mesh(faces[:, ::-1].copy() if inward else faces, POSITION=p))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_camera_outside_an_object_sees_all_of_it(tmp_path: Path, scale: float) -> None:
    gltf = Gltf()
    box(gltf, (0, 0, 0), (2 * scale, scale, scale))
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    camera = scene.cameras[0]
    low, high = scene.bounds
    corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])
    forward = np.subtract(camera.target, camera.eye) / np.linalg.norm(np.subtract(camera.target, camera.eye))
    away = corners - camera.eye
    angle = np.degrees(np.arccos(away @ forward / np.linalg.norm(away, axis=1)))
    assert (angle < camera.fov_y_deg / 2).all() and angle.max() > camera.fov_y_deg / 5


def test_camera_stands_inside_a_room_and_looks_along_it(tmp_path: Path) -> None:
    gltf = Gltf()
    box(gltf, (0, 0, 0), (12, 3, 5), inward=True)
    box(gltf, (9, 0, 2), (10, 1, 3))
    camera = load_scene(gltf.save(tmp_path / "a.glb")).cameras[0]
    assert all(low < v < high for v, low, high in zip(camera.eye, (0, 0, 0), (12, 3, 5), strict=True))
    view = np.subtract(camera.target, camera.eye)
    assert abs(view[0]) > abs(view[2]) and abs(view[1]) < 0.2 * abs(view[0])


def test_camera_looks_into_an_open_box(tmp_path: Path) -> None:
    gltf = Gltf()
    box(gltf, (0, 0, 0), (4, 4, 4), inward=True)
    faces = gltf.json["accessors"][-1]
    faces["count"] -= 6  # without the last two triangles, the wall at z = 4
    camera = load_scene(gltf.save(tmp_path / "a.glb")).cameras[0]
    assert camera.eye[2] > 4 and camera.eye[0] == pytest.approx(2, abs=0.5)


def test_far_from_the_origin_and_degenerate_triangles(tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(np.array([0, 1, 2, 0, 0, 1, 3, 3, 3], dtype=np.uint8)), translation=[1e5, -1e5, 1e5])
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert scene.triangles == 3 and np.isfinite(scene.cameras[0].eye).all()
