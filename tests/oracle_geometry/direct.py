"""Direct light in float64: sun, point and spot lights with their shadows; rectangles in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.scene.scene import PointLight, Scene, SpotLight, SunLight

from .rays import free, holes_of
from .scenes import triangles_of
from .views import unit

Array = NDArray[np.float64]


def spot_share(spot: SpotLight, toward: Array) -> Array:
    """KHR_lights_punctual: a squared ramp over the cosine, from the outer angle to the inner one."""
    cosine = toward @ unit(np.asarray(spot.direction, np.float64))
    inner, outer = np.cos(spot.inner_angle), np.cos(spot.outer_angle)
    return np.asarray(np.clip((cosine - outer) / (inner - outer), 0, 1) ** 2, np.float64)


def lit(
    scene: Scene,
    light: SunLight | PointLight | SpotLight,
    position: ArrayLike,
    normal: ArrayLike,
    lifted: ArrayLike,
    ends: float,
) -> tuple[Array, NDArray[np.bool_]]:
    """(p, 3) irradiance of points, and whether their shadow is sure; `ends` as in :func:`rays.free`.

    `lifted` are the points just off their surfaces, where shadow rays start.
    """
    at, n = np.asarray(position, np.float64), np.asarray(normal, np.float64)
    if isinstance(light, SunLight):
        low, high = scene.bounds
        target = at + 4 * (np.linalg.norm(high - low) + np.abs(at).max()) * unit(np.asarray(light.to_sun, np.float64))
        to = np.broadcast_to(unit(np.asarray(light.to_sun, np.float64)), at.shape)
        arriving = np.broadcast_to(np.asarray(light.irradiance), at.shape)
    else:
        target = np.broadcast_to(np.asarray(light.position, np.float64), at.shape)
        gap = target - at
        to = unit(gap)
        arriving = np.asarray(light.intensity) / (gap**2).sum(axis=1, keepdims=True)
        if isinstance(light, SpotLight):
            arriving = arriving * spot_share(light, -to)[:, None]
    cosine = np.maximum(0, (n * to).sum(axis=1))
    is_free, sure = free(triangles_of(scene), lifted, target, holes_of(scene), ends=ends)
    return arriving * (cosine * is_free)[:, None], sure | (cosine == 0)


def form_factor(at: ArrayLike, normal: ArrayLike, corners: ArrayLike) -> Array:
    """(p,) form factor from points to a whole polygon in front of them, by Lambert's sum over its edges."""
    v = unit(np.asarray(corners, np.float64)[None] - np.asarray(at, np.float64)[:, None])
    n = np.asarray(normal, np.float64)
    total = np.zeros(len(v))
    for i in range(v.shape[1]):
        a, b = v[:, i], v[:, (i + 1) % v.shape[1]]
        angle = np.arccos(np.clip((a * b).sum(axis=1), -1, 1))
        total += angle * (unit(np.cross(a, b)) * n).sum(axis=1)
    return np.abs(total) / (2 * np.pi)
