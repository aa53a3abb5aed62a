"""Rays against every triangle in float64 (Moeller & Trumbore 1997), and how sure an answer is.

A ray that passes within rounding of an edge, or of a hole's border, may honestly be answered either way in float32.
Each query says which of its answers are sure; tests demand those exactly, and that nearly all are sure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.scene.scene import Scene

from .scenes import materials_of
from .textures import bilinear

Array = NDArray[np.float64]
Holes = Callable[[NDArray[np.intp], Array, Array], tuple[NDArray[np.bool_], NDArray[np.bool_]]]


@dataclass(frozen=True)
class Crossings:
    """Every ray with every triangle, (r, t) each: distance in ray lengths, barycentrics, margin inside the triangle.

    `margin` is the smallest of the three barycentrics where the plane is crossed, -inf where it is not.
    """

    t: Array
    u: Array
    v: Array
    margin: Array


def crossings(triangles: Array, origin: ArrayLike, direction: ArrayLike) -> Crossings:
    o, d = np.asarray(origin, np.float64)[:, None], np.asarray(direction, np.float64)[:, None]
    a, b, c = (triangles[None, :, i] for i in range(3))
    e, f = b - a, c - a
    p = np.cross(d, f)
    det = (e * p).sum(-1)
    crossed = np.abs(det) > 1e-300
    inverse = 1 / np.where(crossed, det, 1.0)
    s = o - a
    u = (s * p).sum(-1) * inverse
    q = np.cross(s, e)
    v = (d * q).sum(-1) * inverse
    t = (f * q).sum(-1) * inverse
    margin = np.where(crossed, np.minimum(np.minimum(u, v), 1 - u - v), -np.inf)
    return Crossings(t, u, v, margin)


def holes_of(scene: Scene) -> Holes:
    """Whether the points (u, v) of triangles are holes, and whether that is sure."""
    materials = materials_of(scene)
    uvs = [np.zeros((len(m.position), 2)) if m.uv is None else m.uv.astype(np.float64) for m in scene.meshes]
    corners = np.concatenate([uv[mesh.index] for uv, mesh in zip(uvs, scene.meshes, strict=True)])

    def holes(triangle: NDArray[np.intp], u: Array, v: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        is_hole, is_sure = np.zeros(len(u), bool), np.ones(len(u), bool)
        for row, (i, x, y) in enumerate(zip(triangle, u, v, strict=True)):
            material = materials[i]
            if material.alpha_cutoff <= 0:
                continue
            alpha = material.alpha
            if material.texture >= 0:
                at = (1 - x - y) * corners[i, 0] + x * corners[i, 1] + y * corners[i, 2]
                alpha *= bilinear(scene.textures[material.texture], at[None])[0, 3]
            is_hole[row] = alpha < material.alpha_cutoff
            is_sure[row] = abs(alpha - material.alpha_cutoff) > 1e-3
        return is_hole, is_sure

    return holes


def _crossed(c: Crossings, low: Array, high: Array, edge: float, holes: Holes | None) -> tuple[NDArray[np.bool_], ...]:
    """(r, t): which triangles are hit within (low, high), and which answers are unsure."""
    inside = (c.t > low[:, None]) & (c.t < high[:, None])
    hit, unsure = inside & (c.margin >= 0), inside & (np.abs(c.margin) <= edge)
    if holes is not None:
        ray, triangle = np.nonzero(hit | unsure)
        hole, sure = holes(triangle, c.u[ray, triangle], c.v[ray, triangle])
        unsure[ray, triangle] |= ~sure & hit[ray, triangle]
        hit[ray, triangle] &= ~hole
    return hit, unsure


def nearest(
    triangles: Array, origin: ArrayLike, direction: ArrayLike, holes: Holes | None = None, edge: float = 1e-5
) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_], Crossings]:
    """(r,) distance (inf: none), triangle (-1: none), sure; and all crossings."""
    c = crossings(triangles, origin, direction)
    count = len(c.t)
    hit, unsure = _crossed(c, np.zeros(count), np.full(count, np.inf), edge, holes)
    t = np.where(hit, c.t, np.inf)
    triangle = t.argmin(axis=1)
    best = t[np.arange(count), triangle]
    second = np.where(np.arange(t.shape[1])[None] == triangle[:, None], np.inf, t).min(axis=1)
    finite = np.isfinite(best)
    limit = np.where(finite, best * (1 + 1e-5), np.inf)
    tie = finite & (second <= limit)
    sure = ~tie & ~(unsure & (c.t <= limit[:, None])).any(axis=1)
    return best, np.where(finite, triangle, -1), sure, c


def free(
    triangles: Array,
    origin: ArrayLike,
    target: ArrayLike,
    holes: Holes | None = None,
    edge: float = 1e-5,
    ends: float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(r,) whether the segment is free, and whether that is sure.

    `ends` is a length. A surface crossed within it of the origin counts if the origin lies on it (just off it, that
    is), and is unsure else; crossed within it of the target, it is unsure.
    """
    o, q = np.asarray(origin, np.float64), np.asarray(target, np.float64)
    length = np.maximum(np.linalg.norm(q - o, axis=1), 1e-300)
    c = crossings(triangles, o, q - o)
    hit, unsure = _crossed(c, np.zeros(len(o)), np.ones(len(o)), edge, holes)
    if ends > 0:
        n = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)
        from_origin, from_target = (np.abs(((p[:, None] - triangles[None, :, 0]) * n).sum(-1)) for p in (o, q))
        near = np.minimum(ends / length, 0.5)[:, None]
        crossed = (c.t > 0) & (c.t < 1) & (c.margin >= -edge)
        unsure |= crossed & (c.t < near) & ((from_origin > ends / 10) | (from_target < ends))
        unsure |= crossed & (c.t > 1 - near)
    blocked = hit.any(axis=1)
    sure = ~unsure.any(axis=1) | (hit & ~unsure).any(axis=1)
    return ~blocked, sure
