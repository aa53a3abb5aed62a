"""The G-buffer in float64: camera rays, nearest surfaces and their attributes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.scene.scene import Camera, Scene

from .rays import holes_of, nearest
from .scenes import materials_of, triangles_of
from .textures import bilinear

Array = NDArray[np.float64]


def unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)


def axes(camera: Camera) -> tuple[Array, Array, Array]:
    """Right, up, forward."""
    forward = unit(np.subtract(camera.target, camera.eye).astype(np.float64))
    right = unit(np.cross(forward, np.asarray(camera.up, np.float64)))
    return right, np.cross(right, forward), forward


def camera_rays(camera: Camera, width: int, height: int) -> Array:
    """(H, W, 3) unit directions through the pixels' centres; y runs down the image, pixels are square."""
    right, up, forward = axes(camera)
    half = np.tan(np.radians(camera.fov_y_deg) / 2)
    y = half * (1 - 2 * (np.arange(height) + 0.5) / height)
    x = half * (2 * (np.arange(width) + 0.5) / width - 1) * width / height
    return unit(forward + x[None, :, None] * right + y[:, None, None] * up)


@dataclass(frozen=True)
class View:
    """As lab.records.GBuffer, in float64; `triangle` -1 where nothing is hit.

    `sure` is False at edges; `magnified` where texels are smaller than pixels, so that several are averaged.
    """

    position: Array
    normal: Array
    geometric_normal: Array
    albedo: Array
    emission: Array
    depth: Array
    triangle: NDArray[np.intp]
    sure: NDArray[np.bool_]
    magnified: NDArray[np.bool_]


def texel_density(scene: Scene, triangles: Array) -> Array:
    """(t,) most texels that a length on the surface crosses, per length; 0 without a texture."""
    uv = attribute(scene, "uv", 0, 2)
    density = []
    for corner, at, material in zip(triangles, uv, materials_of(scene), strict=True):
        if material.texture < 0:
            density.append(0.0)
            continue
        height, width = scene.textures[material.texture].shape[:2]
        texels = (at[1:] - at[0]) * [width, height]
        density.append(float(np.linalg.norm(texels.T @ np.linalg.pinv(corner[1:] - corner[0]).T, ord=2)))
    return np.array(density)


def attribute(scene: Scene, name: str, neutral: float, columns: int) -> Array:
    """(t, 3, columns) a vertex attribute at the corners of every triangle."""
    parts = []
    for mesh in scene.meshes:
        values = getattr(mesh, name)
        filled = np.full((len(mesh.position), columns), neutral) if values is None else values.astype(np.float64)
        parts.append(filled[mesh.index])
    return np.concatenate(parts)


def look(scene: Scene, camera: Camera, width: int, height: int) -> View:
    triangles = triangles_of(scene)
    direction = camera_rays(camera, width, height).reshape(-1, 3)
    eye = np.broadcast_to(np.asarray(camera.eye, np.float64), direction.shape)
    t, triangle, sure, c = nearest(triangles, eye, direction, holes_of(scene), edge=2e-5)
    rows = np.arange(len(t))
    found = triangle >= 0
    u, v = c.u[rows, triangle], c.v[rows, triangle]
    bary = np.stack([1 - u - v, u, v], axis=1)[..., None]
    at = {
        name: (attribute(scene, name, neutral, columns)[triangle] * bary).sum(axis=1)
        for name, neutral, columns in (("normal", 0, 3), ("colour", 1, 3), ("uv", 0, 2))
    }
    corner = triangles[triangle]
    geometric = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    has_normal = np.linalg.norm(at["normal"], axis=1, keepdims=True) > 1e-6
    shading = np.where(has_normal, unit(at["normal"]), geometric)
    front = (geometric * direction).sum(1, keepdims=True) <= 0
    seen_side = np.where(front, geometric, -geometric)
    shading = np.where((shading * seen_side).sum(1, keepdims=True) >= 0, shading, -shading)
    material = np.concatenate([np.full(len(mesh.index), mesh.material) for mesh in scene.meshes])[triangle]
    albedo = np.array([m.base_colour for m in scene.materials])[material] * at["colour"]
    for row, m in enumerate(scene.materials):
        if m.texture >= 0 and (material == row).any():
            albedo[material == row] *= bilinear(scene.textures[m.texture], at["uv"][material == row])[:, :3]
    radiance = np.array([m.emission for m in scene.materials])[material]
    two_sided = np.array([m.two_sided for m in scene.materials])[material][:, None]
    position = (corner * bary).sum(axis=1)
    planes = {
        "position": position,
        "normal": shading,
        "geometric_normal": seen_side,
        "albedo": albedo,
        "emission": np.where(front | two_sided, radiance, 0),
    }
    pitch = 2 * np.tan(np.radians(camera.fov_y_deg) / 2) / height
    slope = np.abs((geometric * direction).sum(1))
    crossed = texel_density(scene, triangles)[triangle] * np.where(found, t, 0) * pitch / np.maximum(slope, 1e-9)
    image = {name: np.where(found[:, None], plane, 0).reshape(height, width, 3) for name, plane in planes.items()}
    depth = np.where(found, np.where(found, t, 0) * (direction @ axes(camera)[2]), 0)
    shape = (height, width)
    return View(
        **image,
        depth=depth.reshape(shape),
        triangle=triangle.reshape(shape),
        sure=sure.reshape(shape),
        magnified=(crossed < 0.9).reshape(shape),
    )
