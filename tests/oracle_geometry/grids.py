"""What a pixel receives from each light of a given hierarchy, and what each grid light is made of; float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.params import Params
from lab.records import Hierarchy

Array = NDArray[np.float64]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def levels_of(h: Hierarchy) -> NDArray[np.intp]:
    """(m,) level of each light of the merged buffer."""
    return np.repeat(np.arange(h.top + 1), np.diff(h.offset))


def blend(distance: Array, level: int, h: Hierarchy, params: Params) -> Array:
    """B_l: ramps of [r/2, r] and [r, 2r]; the first drawn level is 1 below r, the top 1 beyond r."""
    r = params.alpha * float(h.cell_size[level])
    up = np.ones_like(distance) if level == params.first_level else (distance - r / 2) / (r / 2)
    down = np.ones_like(distance) if level == h.top else (2 * r - distance) / r
    return np.clip(np.minimum(up, down), 0, 1)


def lobe(h: Hierarchy, rows: ArrayLike, direction: Array, kind: str) -> Array:
    """Share emitted by the lights `rows` toward (..., rows, 3) unit directions from the lights."""
    m = h.normal[rows].astype(np.float64)
    moment = h.normal_moment[rows].astype(np.float64)
    xx, yy, zz, xy, xz, yz = moment.T
    matrix = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(-1, 3, 3)
    along = (direction * m).sum(-1)
    if kind == "moments":
        k = 1 - 0.201 * (1 - np.trace(matrix @ matrix, axis1=1, axis2=2))
        square = np.einsum("...i,...ij,...j->...", direction, matrix, direction)
        value = np.maximum(0, (along + k * np.sqrt(np.maximum(0, square))) / 2)
    else:
        value = np.maximum(0, along)
        if kind == "mean_energy":
            value = value + (1 - np.linalg.norm(m, axis=-1)) / 4
    return np.where(h.oriented[rows] == 0, 0.25, value)


def geometry(
    h: Hierarchy, rows: ArrayLike, position: ArrayLike, normal: ArrayLike, kind: str = "moments"
) -> tuple[Array, Array, Array]:
    """(p, rows) receiver's cosine, emission and distance, of (p, 3) points."""
    to = h.position[rows].astype(np.float64)[None] - np.asarray(position, np.float64)[:, None]
    distance = np.linalg.norm(to, axis=-1)
    w = to / np.maximum(distance, 1e-300)[..., None]
    cosine = np.maximum(0, (w * np.asarray(normal, np.float64)[:, None]).sum(-1))
    return cosine, lobe(h, rows, -w, kind), distance


def contributions(h: Hierarchy, position: ArrayLike, normal: ArrayLike, params: Params, radius: float) -> Array:
    """(p, m, 3) blended, unshadowed irradiance of every light of the merged buffer (hard receiver)."""
    c2 = (params.clamp_distance * radius) ** 2
    parts = []
    for level in range(h.top + 1):
        rows = np.arange(h.offset[level], h.offset[level + 1])
        cosine, emitted, distance = geometry(h, rows, position, normal, params.lobe)
        d2 = distance**2
        falloff = 1 / (np.maximum(d2, c2) if params.falloff == "clamped" else d2 + c2)
        weight = blend(distance, level, h, params) * cosine * emitted * falloff
        if level < params.first_level:
            weight = np.zeros_like(weight)
        parts.append(weight[..., None] * h.flux[rows].astype(np.float64)[None] / np.pi)
    return np.concatenate(parts, axis=1)


def pick_weights(h: Hierarchy, found: Array, params: Params) -> Array:
    """(p, m) f_i from :func:`contributions`: levels >= min(first_shadow_level, top), or all where none of those do."""
    f = found @ LUMINANCE
    if not params.importance:
        f = (f > 0).astype(np.float64)
    chosen = np.where(levels_of(h) >= min(params.first_shadow_level, h.top), f, 0)
    return np.where(chosen.sum(axis=1, keepdims=True) > 0, chosen, f)


def member_shares(h: Hierarchy, construction: str = "gather") -> Array:
    """(m, n): probability of drawing input light j (merged index) from light i.

    In proportion to trilinear weight times luminance; gathered levels go through the level-1 lights.
    """
    n = int(h.offset[1])
    shares = np.zeros((len(h.position), n))
    shares[:n] = np.eye(n)

    def trilinear(level: int, sources: slice) -> Array:
        rows = slice(int(h.offset[level]), int(h.offset[level + 1]))
        vertex = h.origin.astype(np.float64) + h.vertex[rows].astype(np.float64) * float(h.cell_size[level])
        gap = np.abs(h.position[sources].astype(np.float64)[None] - vertex[:, None]) / float(h.cell_size[level])
        weight = np.maximum(0, 1 - gap).prod(-1) * (h.flux[sources].astype(np.float64) @ LUMINANCE)[None]
        return weight / weight.sum(axis=1, keepdims=True)

    for level in range(1, h.top + 1):
        rows = slice(int(h.offset[level]), int(h.offset[level + 1]))
        if level == 1 or construction == "scatter":
            shares[rows] = trilinear(level, slice(0, n))
        else:
            first = slice(int(h.offset[1]), int(h.offset[2]))
            shares[rows] = trilinear(level, first) @ shares[first]
    return shares


def omegas(h: Hierarchy, position: ArrayLike, normal: ArrayLike, params: Params) -> Array:
    """(p, m, n) omega of input light j drawn from light i: cosines of j over those of i, capped; 1 for i = j."""
    n = int(h.offset[1])
    cosine, emitted, _ = geometry(h, np.arange(len(h.position)), position, normal, params.lobe)
    received = cosine * emitted
    whole = received[:, :, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        omega = np.where(whole > 0, received[:, None, :n] / whole, 0)
    cap = np.inf if params.omega_max == "none" else float(params.omega_max)
    omega = np.minimum(cap, omega)
    omega[:, np.arange(n), np.arange(n)] = 1
    return omega
