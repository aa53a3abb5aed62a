"""From a file to a :class:`~lab.scene.scene.Scene` that can be rendered."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lab.errors import LabError
from lab.scene.auto_camera import automatic_camera
from lab.scene.files import GEOMETRY_ENDINGS, check_file, guarded, read_geometry_file
from lab.scene.override import override
from lab.scene.parts import Parts
from lab.scene.scene import Scene
from lab.scene.scene_toml import read_scene_toml
from lab.scene.sidecar import read_sidecar
from lab.scene.sky import SUN_IRRADIANCE, automatic_sun

__all__ = ["load_scene", "override"]

MIN_SIZE, MAX_SIZE = 1e-9, 1e12
"""A scene's diagonal must lie between these: beyond them float32 squares and cubes of lengths vanish or overflow."""


def load_scene(path: str | Path) -> Scene:
    """The scene at `path`: a ``.toml``, ``.glb``, ``.gltf``, ``.obj`` or ``.ply`` file, or a folder with a scene.toml.

    With a bare geometry file, the JSON of the same name beside it is read too (``lab/scene/sidecar.py``). Where nothing
    gives a camera, and in a bare file nothing gives light, one is put in and :attr:`Scene.notes` says so.

    Errors: :class:`LabError` for whatever is wrong with the input; nothing else is raised for bad files.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / "scene.toml").is_file():
            raise LabError(f"{path} is a folder without a scene.toml: name a scene file in it")
        path = path / "scene.toml"
    ending = path.suffix.lower()
    if ending == ".toml":
        check_file(path)
        return _scene(path, guarded(path, read_scene_toml))
    if ending not in GEOMETRY_ENDINGS:
        known = ", ".join([".toml", *GEOMETRY_ENDINGS])
        raise LabError(f"{path} ends in {path.suffix or 'nothing'!r}: scenes are read from {known}")
    parts = read_geometry_file(path)
    beside = path.with_suffix(".json")
    if beside.is_file():
        read_sidecar(beside, parts)
    if not parts.has_light():
        sun = automatic_sun()
        parts.suns.append(sun)
        toward = ",".join(f"{v:.2f}" for v in sun.to_sun)
        parts.note(f"nothing in {path.name} gives light: a sun was put in, from {toward}, irradiance {SUN_IRRADIANCE}")
    return _scene(path, parts)


def _scene(path: Path, parts: Parts) -> Scene:
    """`parts` as a scene, after the checks that concern all of it."""
    if not any(len(mesh.index) for mesh in parts.meshes):
        raise LabError(f"{path} holds no triangles: there is nothing to render; points and lines are not drawn")
    corners = [mesh.position[mesh.index.ravel()] for mesh in parts.meshes]
    low = np.min([points.min(axis=0) for points in corners], axis=0).astype(np.float64)
    high = np.max([points.max(axis=0) for points in corners], axis=0).astype(np.float64)
    size = float(np.linalg.norm(high - low))
    if not MIN_SIZE <= size <= MAX_SIZE:
        raise LabError(
            f"{path}: the scene is {size:g} units across, it must be {MIN_SIZE:g} to {MAX_SIZE:g}: "
            + ("all its vertices lie in one point" if size == 0 else "scale it, or choose other units")
        )
    if float(np.abs([low, high]).max()) > MAX_SIZE:
        raise LabError(f"{path}: the scene lies {np.abs([low, high]).max():g} units from the origin: move it there")
    if not parts.cameras:
        camera, taken_for = automatic_camera(parts.meshes)
        parts.cameras.append(camera)
        parts.note(f"{path.name} has no camera: one was put in, taking the scene for {taken_for}")
    return Scene(
        name=parts.name or path.stem,
        meshes=parts.meshes,
        materials=parts.materials,
        textures=parts.textures,
        suns=parts.suns,
        points=parts.points,
        spots=parts.spots,
        light_list=parts.light_list,
        cameras=parts.cameras,
        exposure=parts.exposure,
        background=(0.0, 0.0, 0.0) if parts.background is None else parts.background,
        path=str(path),
        notes=parts.notes,
        files=[path, *parts.files],
    )
