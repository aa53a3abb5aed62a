"""A piece of geometry as plain arrays, and what can be done with one: move, turn, merge, map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles that share one material.

    Attributes:
        position: (n, 3) metres.    normal: (n, 3) unit.    uv: (n, 2) in repeats of the texture, v down.
        index: (t, 3) counter-clockwise seen from the front.
        prototype: the part this one is a copy of, so that the file holds it once.    pose: (4, 4) from it to here.

    """

    position: Floats
    normal: Floats
    uv: Floats
    index: NDArray[np.int64]
    prototype: Part | None = None
    pose: Floats = field(default_factory=lambda: np.eye(4))

    def _placed(self, matrix: Floats) -> Floats:
        """The pose after a further transform by `matrix` (3, 3) or (4, 4)."""
        step = np.eye(4)
        step[: len(matrix), : len(matrix)] = matrix
        return np.asarray(step @ self.pose)


Model = list[tuple[str, Part]]
"""What a scene is made of: names of finishes, and the parts that have them."""


def repeatable(part: Part) -> Part:
    """`part` as a prototype: its moved, turned and scaled copies are stored as copies."""
    return replace(part, prototype=part, pose=np.eye(4))


def merge(parts: Sequence[Part]) -> Part:
    """All `parts` as one."""
    offsets = np.cumsum([0, *(len(part.position) for part in parts)])
    return Part(
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.normal for part in parts]),
        np.concatenate([part.uv for part in parts]),
        np.concatenate([part.index + offset for part, offset in zip(parts, offsets, strict=False)]),
    )


def moved(part: Part, x: float = 0, y: float = 0, z: float = 0) -> Part:
    """`part` shifted by (x, y, z) metres."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return replace(part, position=part.position + matrix[:3, 3], pose=part._placed(matrix))


def turned(part: Part, degrees: float, axis: str = "y") -> Part:
    """`part` turned about a coordinate axis through the origin, counter-clockwise seen from the axis' tip."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]
    pose = part._placed(matrix)
    return replace(part, position=part.position @ matrix.T, normal=part.normal @ matrix.T, pose=pose)


def placed(model: Model, x: float = 0, y: float = 0, z: float = 0, degrees: float = 0) -> Model:
    """All of `model` turned about +Y, then moved."""
    return [(name, moved(turned(part, degrees) if degrees else part, x, y, z)) for name, part in model]


def mirrored(part: Part) -> Part:
    """`part` seen in a mirror across the plane x = 0."""
    flip = np.array([-1.0, 1.0, 1.0])
    return Part(part.position * flip, part.normal * flip, part.uv, part.index[:, ::-1])


def scaled(part: Part, factor: float) -> Part:
    """`part` scaled evenly about the origin."""
    return replace(part, position=part.position * factor, pose=part._placed(factor * np.eye(3)))


def uv_moved(part: Part, u: float, v: float) -> Part:
    """`part` with its texture shifted, so that copies don't look alike."""
    return replace(part, uv=part.uv + np.array([u, v]), prototype=None)


def box_mapped(part: Part, metres: float) -> Part:
    """`part` with UVs projected along the axis its normals point along most; one repeat is `metres` long.

    Only for parts whose vertices are not shared over edges where that axis changes.
    """
    axis = np.abs(part.normal).argmax(axis=1)
    x, y, z = (part.position / metres).T
    u = np.choose(axis, [z, x, x])
    v = np.choose(axis, [-y, z, -y])
    return replace(part, uv=np.stack([u, v], axis=1), prototype=None)


def smooth_normals(position: Floats, index: NDArray[np.int64]) -> Floats:
    """(n, 3) unit normals, area-weighted over the triangles around each point; coincident points share theirs."""
    _, weld = np.unique(np.round(position, 6), axis=0, return_inverse=True)
    weld = weld.reshape(-1)
    a, b, c = (position[index[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    total = np.zeros((weld.max() + 1, 3))
    for k in range(3):
        np.add.at(total, weld[index[:, k]], face)
    normal = total[weld]
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.where(length > 1e-14, normal / np.maximum(length, 1e-14), np.array([0.0, 1.0, 0.0]))


def surface(points: ArrayLike, uv: ArrayLike, *, flip: bool = False) -> Part:
    """A smooth grid. `points` (rows, columns, 3), `uv` (rows, columns, 2); its front is along d/drow x d/dcolumn."""
    grid, coords = np.asarray(points, dtype=np.float64), np.asarray(uv, dtype=np.float64)
    rows, columns = grid.shape[:2]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    down, right, both = corner + columns, corner + 1, corner + columns + 1
    index = np.concatenate([np.stack([corner, down, both], 1), np.stack([corner, both, right], 1)])
    if flip:
        index = index[:, [0, 2, 1]]
    position = grid.reshape(-1, 3)
    return Part(position, smooth_normals(position, index), coords.reshape(-1, 2), index)
