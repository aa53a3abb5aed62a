"""The shared test scenes: what their JSON says is what is loaded."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from lab.scene.load import load_scene


def test_shared_scenes(shared_scenes: Path) -> None:
    names = ["breakfast_room", "cornell_box", "living_room", "modern_hall", "sponza"]
    for name in names:
        told = json.loads((shared_scenes / f"{name}.json").read_text())
        scene = load_scene(shared_scenes / f"{name}.glb")
        assert scene.triangles == told["triangles"]
        assert len(scene.materials) == told["materials"] and len(scene.textures) == told["textures"]
        np.testing.assert_allclose(scene.bounds, told["bbox"], atol=1e-3)
        assert [camera.name for camera in scene.cameras] == [camera["name"] for camera in told["cameras"]]
        assert len(scene.suns) == (0 if told["sun_direction_to_sun"] is None and told["emitters"] else 1)
        lit = {m.name: m.emission for m in scene.materials if max(m.emission) > 0}
        assert lit == {e["material"]: pytest.approx(tuple(e["radiance"])) for e in told["emitters"]}
        holes = {m.name for m in scene.materials if m.alpha_cutoff > 0}
        assert holes == {*told["mask_materials"], *told["blend_materials"]}
        for mesh in scene.meshes:
            assert mesh.index.max() < len(mesh.position) and np.isfinite(mesh.position).all()
            np.testing.assert_allclose(np.linalg.norm(mesh.normal.astype(float), axis=1), 1, atol=1e-5)
    masked = [scene.textures[m.texture] for m in scene.materials if m.alpha_cutoff > 0]
    assert len(masked) == 3 and all(texture[..., 3].min() == 0 for texture in masked)


def test_shared_scenes_agree_with_open3d(shared_scenes: Path) -> None:
    """An outside reader: open3d groups the triangles otherwise, but the surface it finds is the same."""
    import open3d

    for name in ("cornell_box", "sponza"):
        scene = load_scene(shared_scenes / f"{name}.glb")
        model = open3d.io.read_triangle_model(shared_scenes / f"{name}.glb")
        corners = np.concatenate([np.asarray(m.mesh.vertices)[np.asarray(m.mesh.triangles)] for m in model.meshes])
        ours = np.concatenate([mesh.position[mesh.index] for mesh in scene.meshes]).astype(float)
        assert len(ours) == len(corners)
        for moment in (1, 2):
            np.testing.assert_allclose((ours**moment).sum(axis=(0, 1)), (corners**moment).sum(axis=(0, 1)), rtol=1e-6)


def test_shared_scenes_without_their_sidecars(shared_scenes: Path, tmp_path: Path) -> None:
    for name in ("breakfast_room", "living_room", "modern_hall", "sponza"):
        shutil.copy(shared_scenes / f"{name}.glb", tmp_path)
        scene = load_scene(tmp_path / f"{name}.glb")
        low, high = scene.bounds
        (camera,) = scene.cameras
        assert (low < camera.eye).all() and (camera.eye < high).all(), name
        assert any("a room, seen from within" in note for note in scene.notes)
    shutil.copy(shared_scenes / "cornell_box.glb", tmp_path)
    camera = load_scene(tmp_path / "cornell_box.glb").cameras[0]
    assert camera.eye[2] < 0 and camera.target[2] > camera.eye[2]  # through the missing wall
