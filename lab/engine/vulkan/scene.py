"""The scene on the device: one soup of triangles, as the core holds it (core_cpp/src/scene.cpp)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.vulkan.scene_textures import upload_textures
from lab.engine.vulkan.scene_tree import Tree
from lab.scene.scene import Mesh, Scene

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

TRIANGLE = np.dtype([("corner", "3u4"), ("material", "u4"), ("normal", "3f4"), ("double_area", "f4")])
VERTEX = np.dtype(
    [("position", "3f4"), ("u", "f4"), ("normal", "3f4"), ("v", "f4"), ("colour", "3f4"), ("unused", "u4")]
)
MATERIAL = np.dtype(
    [
        ("base_colour", "3f4"),
        ("texture", "i4"),
        ("emission", "3f4"),
        ("two_sided", "u4"),
        ("alpha", "f4"),
        ("alpha_cutoff", "f4"),
        ("unused", "2f4"),
    ]
)


class DeviceScene:
    """A scene's geometry, materials and textures on the device, and the tree over them.

    Attributes:
        uniform: the value of a shader's ``SceneBuffers``.
        triangles: their rows on the host: those without holes, then the others.    order: of each row, its number among
            the scene's triangles.    corner_position: (t, 3, 3) of the rows.
        centre, radius: of the sphere around the geometry; R.

    """

    def __init__(self, gpu: Gpu, scene: Scene) -> None:
        vertices = _vertices(scene)
        materials = _materials(scene)
        triangles = _triangles(scene, vertices["position"])
        holes = _has_holes(materials)[triangles["material"]]
        self.order = np.argsort(holes, kind="stable")
        self.triangles = triangles[self.order]
        self.materials = materials
        self.corner_position: NDArray[np.float32] = vertices["position"][self.triangles["corner"]]
        self.centre, self.radius = _sphere(self.corner_position)
        solid = len(holes) - int(holes.sum())
        corner = self.triangles["corner"]
        parts = [part for part in ((corner[:solid], False), (corner[solid:], True)) if len(part[0])]
        self._tree = Tree(gpu, vertices["position"], parts)
        self.uniform: dict[str, Any] = {
            "tree": self._tree.top,
            "triangles": gpu.pool.upload(self.triangles, "triangles"),
            "vertices": gpu.pool.upload(vertices, "vertices"),
            "materials": gpu.pool.upload(materials, "materials"),
            "textures": upload_textures(gpu, scene.textures),
            "first_triangle": (0, solid if len(parts) > 1 else 0),
            "centre": tuple(self.centre),
            "radius": self.radius,
        }


def _vertices(scene: Scene) -> NDArray[Any]:
    """All meshes' vertices; a mesh without an attribute gets its neutral value."""
    rows = np.zeros(sum(len(mesh.position) for mesh in scene.meshes), VERTEX)

    def fill(value: Callable[[Mesh], NDArray[np.float32] | None], neutral: float, columns: int) -> NDArray[np.float32]:
        parts = [(value(mesh), len(mesh.position)) for mesh in scene.meshes]
        return np.concatenate([np.full((n, columns), neutral, np.float32) if p is None else p for p, n in parts])

    rows["position"] = fill(lambda mesh: mesh.position, 0, 3)
    rows["normal"] = fill(lambda mesh: mesh.normal, 0, 3)
    rows["colour"] = fill(lambda mesh: mesh.colour, 1, 3)
    uv = fill(lambda mesh: mesh.uv, 0, 2)
    rows["u"], rows["v"] = uv[:, 0], uv[:, 1]
    return rows


def _materials(scene: Scene) -> NDArray[Any]:
    rows = np.zeros(len(scene.materials), MATERIAL)
    for row, material in zip(rows, scene.materials, strict=True):
        for name in ("base_colour", "texture", "emission", "two_sided", "alpha", "alpha_cutoff"):
            row[name] = getattr(material, name)
    return rows


def _has_holes(materials: NDArray[Any]) -> NDArray[np.bool_]:
    masked: NDArray[np.bool_] = materials["alpha_cutoff"] > 0
    return masked & ((materials["texture"] >= 0) | (materials["alpha"] < materials["alpha_cutoff"]))


def _triangles(scene: Scene, position: NDArray[np.float32]) -> NDArray[Any]:
    meshes = scene.meshes
    first = np.concatenate([[0], np.cumsum([len(mesh.position) for mesh in meshes])[:-1]]).astype(np.uint32)
    rows = np.zeros(scene.triangles, TRIANGLE)
    rows["corner"] = np.concatenate([mesh.index + start for mesh, start in zip(meshes, first, strict=True)])
    rows["material"] = np.repeat([mesh.material for mesh in meshes], [len(mesh.index) for mesh in meshes])
    a, b, c = (position[rows["corner"][:, k]].astype(np.float64) for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    rows["normal"] = normal / np.where(length > 0, length, 1)[:, None]
    rows["double_area"] = length
    return rows


def _sphere(corners: NDArray[np.float32]) -> tuple[NDArray[np.float32], float]:
    """Centre of the box around all corners, and how far the farthest is from it."""
    points = corners.reshape(-1, 3)
    centre = np.float32(0.5) * (points.min(axis=0) + points.max(axis=0))
    return centre, float(np.sqrt(np.square(points - centre).sum(axis=1).max()))
