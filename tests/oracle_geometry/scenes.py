"""Small scenes, built in Python, whose light can be worked out by hand."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.engine.cpu import CpuEngine
from lab.records import GBuffer, Lights
from lab.scene.scene import Camera, Material, Mesh, PointLight, Scene, SpotLight

Array = NDArray[np.float64]


def quad(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike, material: int = 0, uv: bool = False) -> Mesh:
    """Two triangles, counter-clockwise a b c d seen from the front; `uv` runs (0,0) at a to (1,1) at c."""
    corners = np.array([a, b, c, d], np.float32)
    texture = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32) if uv else None
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), material, uv=texture)


def box(low: ArrayLike, high: ArrayLike, material: int = 0, inward: bool = False) -> Mesh:
    """The six sides of a box, facing outward, or inward for a room."""
    corners = np.array([low, high], np.float64)
    position = np.array([[corners[i, 0], corners[j, 1], corners[k, 2]] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    index = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))], np.uint32)
    return Mesh(position.astype(np.float32), index[:, ::-1].copy() if inward else index, material)


def soup(seed: int, count: int, size: float = 0.5, scale: float = 1.0, shift: float = 0.0) -> Mesh:
    """Random triangles in a cube of half-edge `scale` around (shift, shift, shift), each with its own vertices."""
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-1, 1, (count, 1, 3))
    corners = (centre + rng.normal(0, size, (count, 3, 3))) * scale + shift
    return Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3))


def scene_of(meshes: Sequence[Mesh], materials: Sequence[Material] = (Material(),), **more: object) -> Scene:
    """A scene with a camera that looks at the origin."""
    camera = Camera("front", (0.0, 1.0, 3.0), (0.0, 0.8, 0.0))
    return Scene("test", list(meshes), list(materials), cameras=[camera], **more)  # type: ignore[arg-type]


def triangles_of(scene: Scene) -> Array:
    """(t, 3, 3) corners of every triangle, in the order the core numbers them."""
    return np.concatenate([mesh.position[mesh.index] for mesh in scene.meshes]).astype(np.float64)


def materials_of(scene: Scene) -> list[Material]:
    """The material of every triangle."""
    return [scene.materials[mesh.material] for mesh in scene.meshes for _ in mesh.index]


def occluded_room(lights: Lights | None = None, **more: object) -> Scene:
    """A room of 4 x 2 x 4 with a pillar and a hanging slab, in three colours: nothing sees everything."""
    materials = [Material("walls", (0.7, 0.6, 0.5)), Material("pillar", (0.3, 0.5, 0.8)), Material("slab", (0.6,) * 3)]
    meshes = [
        box((-2, 0, -2), (2, 2, 2), 0, inward=True),
        box((-0.9, 0, -0.8), (-0.4, 1.4, -0.2), 1),
        box((0.2, 1.1, -1.0), (1.4, 1.2, 0.6), 2),
    ]
    return scene_of(meshes, materials, light_list=lights, **more)


def wall_lights(seed: int, count: int, oriented: float = 0.7) -> Lights:
    """Lights on and between the walls of :func:`occluded_room`; a share `oriented` of them emit to one side."""
    rng = np.random.default_rng(seed)
    position = rng.uniform((-1.9, 0.05, -1.9), (1.9, 1.95, 1.9), (count, 3))
    axis = rng.integers(0, 3, count)
    side = rng.integers(0, 2, count)
    rows = np.arange(count)
    normal = np.zeros((count, 3))
    low, high = np.array([-2.0, 0.0, -2.0]), np.array([2.0, 2.0, 2.0])
    wall = np.where(side == 0, low[axis] + 1e-3, high[axis] - 1e-3)
    on_wall = rng.random(count) < oriented
    position[rows[on_wall], axis[on_wall]] = wall[on_wall]
    normal[rows[on_wall], axis[on_wall]] = np.where(side == 0, 1.0, -1.0)[on_wall]
    flux = rng.gamma(1.0, 1.0, (count, 3)) + 0.05
    return Lights(position.astype(np.float32), flux.astype(np.float32), normal.astype(np.float32))


def points_as_gbuffer(position: ArrayLike, normal: ArrayLike, albedo: float = 0.5) -> GBuffer:
    """Given (H, W, 3) points and unit normals, the G-buffer of an imaginary camera that sees them."""
    p, n = np.ascontiguousarray(position, np.float32), np.ascontiguousarray(normal, np.float32)
    return GBuffer(
        position=p,
        normal=n,
        geometric_normal=n.copy(),
        albedo=np.full_like(p, albedo),
        emission=np.zeros_like(p),
        depth=np.ones(p.shape[:2], np.float32),
        pixel_angle=0.01,
    )


def tilted(gbuffer: GBuffer, seed: int = 0) -> GBuffer:
    """`gbuffer` with shading normals up to 25 degrees off its surfaces', as if interpolated."""
    turn = np.random.default_rng(seed).uniform(-0.27, 0.27, gbuffer.normal.shape)
    normal = gbuffer.geometric_normal + turn
    normal *= (gbuffer.depth > 0)[..., None] / np.linalg.norm(normal, axis=-1, keepdims=True)
    return dataclasses.replace(gbuffer, normal=np.ascontiguousarray(normal, np.float32))


def core_of(scene: Scene) -> Any:
    """The C++ scene under an engine."""
    return CpuEngine(scene)._core_scene


def lamp_room() -> Scene:
    """The occluded room, lit by a point, a spot and a lamp; a window of background."""
    lamp = quad((-0.5, 1.95, -0.5), (0.5, 1.95, -0.5), (0.5, 1.95, 0.5), (-0.5, 1.95, 0.5), 3)
    scene = occluded_room(
        points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 3.0))], spots=[SpotLight((0, 1.9, 1), (0, -1, -0.5), (4, 4, 4))]
    )
    walls = dataclasses.replace(scene.meshes[0], index=scene.meshes[0].index[:10])
    materials = [*scene.materials, Material("lamp", emission=(4.0, 3.0, 2.0))]
    return dataclasses.replace(
        scene, meshes=[walls, *scene.meshes[1:], lamp], materials=materials, background=(0.2, 0.3, 0.5)
    )
