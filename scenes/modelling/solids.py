"""The few solids everything is built of: boxes, turned shapes, swept mouldings, beads and tubes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from modelling.mesh import Floats, Part, box_mapped, merge, surface

Pieces = Sequence[ArrayLike]
"""A profile: polylines (k, 2); each is smooth, and an edge is sharp where one ends and the next begins."""


def quad(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike, metres: float = 1.0) -> Part:
    """A flat rectangle, counter-clockwise corners seen from the front, box-mapped."""
    corners = np.array([[a, b], [d, c]], dtype=np.float64)
    return box_mapped(surface(corners, np.zeros((2, 2, 2)), flip=True), metres)


def panel(x0: float, x1: float, y0: float, y1: float, z: float, metres: float = 1.0) -> Part:
    """An upright rectangle that faces +z."""
    return quad((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z), metres)


def box(low: Sequence[float], high: Sequence[float], metres: float = 1.0, skip: str = "") -> Part:
    """An axis-parallel box with sharp edges; `skip` names faces to leave out, of "-x +x -y +y -z +z"."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    faces = {
        "-x": ((x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)),
        "+x": ((x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)),
        "-y": ((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
        "+y": ((x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)),
        "-z": ((x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)),
        "+z": ((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
    }
    return merge([quad(*corners, metres=metres) for name, corners in faces.items() if name not in skip.split()])


def facets(*points: tuple[float, float]) -> list[list[tuple[float, float]]]:
    """A profile through `points` with a sharp edge at each of them."""
    return [[a, b] for a, b in itertools.pairwise(points)]


def curve(points: ArrayLike, samples: int) -> Floats:
    """(samples, 2) points of a Catmull-Rom curve through `points` (k, 2)."""
    p = np.asarray(points, dtype=np.float64)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    at = np.linspace(0, len(p) - 3, samples)
    i = np.minimum(at.astype(int), len(p) - 4)
    t = (at - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    point: Floats = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
    return point


def lathe(
    pieces: Pieces, segments: int, metres: float = 1.0, lobes: Callable[[Floats, Floats], Floats] | None = None
) -> Part:
    """A shape turned about +Y from profile `pieces` of (radius, height), listed bottom to top.

    `lobes(angle, height)` scales the radius, to carve leaves and flutes. One texture repeat is `metres` long; round
    the axis it is a whole number of repeats, so that there is no seam.
    """
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    parts = []
    for piece in pieces:
        radius, height = np.asarray(piece, dtype=np.float64).T
        steps = np.hypot(np.diff(radius), np.diff(height))
        along = np.concatenate([[0], np.cumsum(steps)])
        wide = radius[:, None] * np.ones_like(angle)
        if lobes is not None:
            wide = wide * lobes(angle[None, :], height[:, None])
        points = np.stack([wide * np.cos(angle), height[:, None] + 0 * angle, wide * np.sin(angle)], axis=-1)
        points[:, -1] = points[:, 0]
        turns = max(1.0, np.round(2 * np.pi * radius.max() / metres))
        v = -(height[0] + along) / metres
        uv = np.stack(np.broadcast_arrays(turns * angle / (2 * np.pi), v[:, None]), axis=-1)
        parts.append(surface(points, uv))
    return merge(parts)


def sweep(
    pieces: Pieces, path: ArrayLike, across: ArrayLike, up: ArrayLike, metres: float = 1.0, *, sharp: bool = False
) -> Part:
    """A moulding: profile `pieces` of (across, up) carried along `path`.

    `path`, `across`, `up`: (n, 3) each; the two directions span the profile's plane at each point of the path (longer
    than one for a mitre). The front is along d/dprofile x d/dpath. `sharp`: an edge at every point of the path.
    """
    origin, a, b = (np.asarray(v, dtype=np.float64) for v in (path, across, up))
    run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(origin, axis=0), axis=1))]) / metres
    stretches = [slice(k, k + 2) for k in range(len(origin) - 1)] if sharp else [slice(None)]
    parts = []
    offset = 0.0
    for piece in pieces:
        profile = np.asarray(piece, dtype=np.float64)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))]) / metres
        points = origin + profile[:, None, :1] * a + profile[:, None, 1:] * b
        uv = np.stack(np.broadcast_arrays(run, -(offset + along)[:, None]), axis=-1)
        offset += along[-1]
        parts += [surface(points[:, s], uv[:, s]) for s in stretches]
    return merge(parts)


def mitred_frame(corners: ArrayLike, *, inward: bool = True) -> tuple[Floats, Floats, Floats]:
    """Path, across and up for :func:`sweep` along a closed rectangle in the plane y = const.

    `corners` (4, 3), counter-clockwise seen from above; across points into the rectangle (or out of it).
    """
    p = np.asarray(corners, dtype=np.float64)
    nxt, prv = np.roll(p, -1, axis=0) - p, np.roll(p, 1, axis=0) - p
    unit = nxt / np.linalg.norm(nxt, axis=1, keepdims=True) + prv / np.linalg.norm(prv, axis=1, keepdims=True)
    across = unit if inward else -unit
    path, side = np.concatenate([p, p[:1]]), np.concatenate([across, across[:1]])
    return path, side, np.tile([0.0, 1.0, 0.0], (5, 1))


def ball(radius: float, rows: int = 4, columns: int = 6) -> Part:
    """A sphere at the origin."""
    t = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)
    return lathe([np.stack([radius * np.cos(t), radius * np.sin(t)], axis=1)], columns)


def tube(path: ArrayLike, radius: float, sides: int = 6, metres: float = 1.0) -> Part:
    """A round bar along `path` (n, 3), open at its ends."""
    p = np.asarray(path, dtype=np.float64)
    tangent = np.gradient(p, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    aside = np.array([0.0, 1.0, 0.0]) if abs(tangent[:, 1]).max() < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(tangent, aside)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, sides + 1)
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    ring[-1] = ring[0]
    return sweep([ring], p, across, np.cross(tangent, across), metres)


def ring(radius: float, thickness: float, segments: int = 10, sides: int = 5) -> Part:
    """A torus in the plane x-y: one link of a chain."""
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    outward = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    outward[-1] = outward[0]
    around = np.linspace(0, -2 * np.pi, sides + 1)
    profile = thickness * np.stack([np.cos(around), np.sin(around)], axis=1)
    profile[-1] = profile[0]
    return sweep([profile], radius * outward, outward, np.tile([0.0, 0.0, 1.0], (segments + 1, 1)))
