"""A camera for a scene that brings none: from outside for an object, from within for a room.

The scene is taken as a cloud of points spread evenly over its surfaces. From a place inside, the nearest point in each
of some hundred directions tells how closed in the place is, and whether it lies in a solid, where only back faces show.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lab.scene.scene import Camera, Mesh, Vec3

Array = NDArray[np.float64]

_SAMPLES = 40_000
_ROWS, _COLUMNS = 24, 48  # of a panorama; the rows are of equal solid angle
_INSIDE_FOV, _OUTSIDE_FOV = 60.0, 45.0


@dataclass(frozen=True)
class _Cloud:
    """Points (n, 3) spread evenly over the surfaces, the unit normals (n, 3) and meshes (n,) of their triangles."""

    point: Array
    normal: Array
    mesh: NDArray[np.int64]

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Of all but the outermost half percent: a far speck does not count."""
        return np.quantile(self.point, 0.005, axis=0), np.quantile(self.point, 0.995, axis=0)

    @cached_property
    def sphere(self) -> tuple[Array, float]:
        """Centre and radius of the sphere around the bounding box of all points."""
        low, high = self.point.min(axis=0), self.point.max(axis=0)
        return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-12)


@dataclass(frozen=True)
class _Panorama:
    """What `eye` sees: (rows, columns) distance of the nearest point (inf: none), if it is a front face, its mesh."""

    eye: Array
    distance: Array
    front: NDArray[np.bool_]
    mesh: NDArray[np.int64]

    @property
    def in_room(self) -> bool:
        """Closed in by surfaces that face the eye."""
        seen = np.isfinite(self.distance)
        return bool(seen.mean() >= 0.7 and self.front[seen].mean() >= 0.5)


def automatic_camera(meshes: list[Mesh]) -> tuple[Camera, str]:
    """A camera that shows `meshes` (some triangle of them has an area), and in words what it was taken for."""
    cloud = _sample(meshes)
    rooms = [panorama for panorama in _panoramas(cloud) if panorama.in_room]
    if len(rooms) >= 12:  # of 50 places
        heading = _open_side(rooms)
        if heading is not None:
            heading = round(heading / (math.pi / 2)) * math.pi / 2  # square to the missing wall
            return _facing(
                cloud, np.array([math.cos(heading), 0.0, math.sin(heading)])
            ), "a room seen through its open side"
        return _from_within(cloud, rooms), "a room, seen from within"
    return _from_outside(cloud), "an object, seen from outside"


def _sample(meshes: list[Mesh]) -> _Cloud:
    corner = np.concatenate([mesh.position.astype(np.float64)[mesh.index] for mesh in meshes])
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.index) for mesh in meshes])
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(across, axis=1)
    if not 0 < area.sum() < math.inf:  # lines and points only: their corners have to do
        flat = corner.reshape(-1, 3)
        return _Cloud(flat, np.zeros_like(flat), np.repeat(owner, 3))
    random = np.random.default_rng(1)
    total = np.cumsum(area)
    step = (np.arange(_SAMPLES) + random.random(_SAMPLES)) / _SAMPLES
    row = np.minimum(np.searchsorted(total, step * total[-1], side="right"), len(area) - 1)
    u, v = random.random((2, _SAMPLES, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = corner[row, 0], corner[row, 1], corner[row, 2]
    return _Cloud(a + u * (b - a) + v * (c - a), across[row] / np.maximum(area[row], 1e-300)[:, None], owner[row])


def _panoramas(cloud: _Cloud) -> list[_Panorama]:
    """From 5 x 5 places in plan, at two heights a person may stand at."""
    low, high = cloud.bounds
    across = (0.15, 0.325, 0.5, 0.675, 0.85)
    places = [(x, y, z) for y in (0.25, 0.4) for x in across for z in across]
    return [_panorama(cloud, low + (high - low) * place) for place in places]


def _panorama(cloud: _Cloud, eye: Array) -> _Panorama:
    way = cloud.point - eye
    distance = np.linalg.norm(way, axis=1)
    way /= np.maximum(distance, 1e-300)[:, None]
    row = np.clip(((way[:, 1] + 1) / 2 * _ROWS).astype(np.int64), 0, _ROWS - 1)
    turn = np.arctan2(way[:, 2], way[:, 0]) / (2 * math.pi) + 0.5
    cell = row * _COLUMNS + np.clip((turn * _COLUMNS).astype(np.int64), 0, _COLUMNS - 1)
    seen = np.full(_ROWS * _COLUMNS, math.inf)
    np.minimum.at(seen, cell, distance)
    nearest = np.flatnonzero(distance == seen[cell])
    cells = cell[nearest]
    front = np.zeros(_ROWS * _COLUMNS, dtype=bool)
    mesh = np.full(_ROWS * _COLUMNS, -1, dtype=np.int64)
    mesh[cells] = cloud.mesh[nearest]
    front[cells] = np.einsum("ij,ij->i", way[nearest], cloud.normal[nearest]) < 0
    shape = (_ROWS, _COLUMNS)
    return _Panorama(eye, seen.reshape(shape), front.reshape(shape), mesh.reshape(shape))


def _open_side(rooms: list[_Panorama]) -> float | None:
    """The heading in which most places look out level through a missing wall, as in a doll's house; or None."""
    level = np.mean([np.isinf(room.distance[_ROWS * 3 // 8 : _ROWS * 5 // 8]) for room in rooms], axis=(0, 1))
    wide = [float(np.take(level, range(c - 3, c + 4), mode="wrap").mean()) for c in range(_COLUMNS)]
    column = int(np.argmax(wide))
    return (column / _COLUMNS - 0.5) * 2 * math.pi if wide[column] > 0.4 else None


def _from_within(cloud: _Cloud, rooms: list[_Panorama]) -> Camera:
    """Level, roughly along the longest horizontal axis and toward the middle, where much is to be seen.

    A view counts by its mean distance, by the edges in it (furniture, columns, doors: an empty corner has none), by
    nothing standing right before the eye, and by how many meshes, so mostly materials, are in it: a void between walls
    shows one or two. Back faces count as nothing at all.
    """
    low, high = cloud.bounds
    size, middle = float(np.linalg.norm(high - low)), (low + high) / 2
    long_axis = 0.0 if high[0] - low[0] >= high[2] - low[2] else math.pi / 2
    best, choice = -1.0, (rooms[0].eye, long_axis)
    for room in rooms:
        far = np.where(room.front & np.isfinite(room.distance), room.distance, 0.0) / size
        steps = np.abs(np.diff(np.log(far + 0.01), axis=1, append=np.log(far[:, :1] + 0.01))) > 0.25
        toward = math.atan2(middle[2] - room.eye[2], middle[0] - room.eye[0])
        for column in range(_COLUMNS):
            angle = (column / _COLUMNS - 0.5) * 2 * math.pi
            if _turn(angle, toward) > math.radians(50) or abs(math.cos(_turn(angle, long_axis))) < 0.7:
                continue
            window = np.arange(column - _COLUMNS // 10, column + _COLUMNS // 10) % _COLUMNS
            view, edges = far[_ROWS // 4 : -_ROWS // 4, window], steps[_ROWS // 4 : -_ROWS // 4, window]
            meshes = len(np.unique(room.mesh[_ROWS // 4 : -_ROWS // 4, window]))
            free = min(1.0, float(np.quantile(view, 0.1)) / 0.1)
            score = math.sqrt(float(view.mean())) * (0.1 + float(edges.mean())) * (0.2 + 0.8 * free) * meshes
            if score > best:
                best, choice = score, (room.eye, angle)
    eye, angle = choice
    reach = np.array([math.cos(angle), -0.05, math.sin(angle)]) * 0.25 * size
    return Camera("automatic", _vec3(eye), _vec3(eye + reach), fov_y_deg=_INSIDE_FOV)


def _turn(a: float, b: float) -> float:
    """Angle between two headings, 0 to pi."""
    return abs((a - b + math.pi) % (2 * math.pi) - math.pi)


def _from_outside(cloud: _Cloud) -> Camera:
    """From a little above, on the side that shows most front faces: an open box is looked into."""
    best, toward = -1.0, np.zeros(3)
    for azimuth in (60, 105, 150, 195, 240, 285, 330, 15):
        angle, height = math.radians(azimuth), math.radians(20)
        way = np.array([math.cos(angle) * math.cos(height), math.sin(height), math.sin(angle) * math.cos(height)])
        share = _front_share(cloud, way)
        if share > best + 0.05:  # among equals the first: from the front, slightly right
            best, toward = share, way
    return _facing(cloud, toward)


def _facing(cloud: _Cloud, way: Array) -> Camera:
    """From direction `way`, far enough to have all of the scene in the picture."""
    centre, radius = cloud.sphere
    eye = centre + way * radius / math.sin(math.radians(_OUTSIDE_FOV / 2))
    return Camera("automatic", _vec3(eye), _vec3(centre), fov_y_deg=_OUTSIDE_FOV)


def _front_share(cloud: _Cloud, way: Array) -> float:
    """Share of front faces in the parallel view from direction `way`, on a grid of 48 x 48."""
    centre, radius = cloud.sphere
    right = np.cross((0.0, 1.0, 0.0), way)
    right /= np.linalg.norm(right)
    local = (cloud.point - centre) / radius
    x, y = (local @ right + 1) * 24, (local @ np.cross(way, right) + 1) * 24
    cell = np.clip(x.astype(int), 0, 47) * 48 + np.clip(y.astype(int), 0, 47)
    order = np.lexsort((-(local @ way), cell))
    _, first = np.unique(cell[order], return_index=True)
    return float((cloud.normal[order[first]] @ way > 0).mean())


def _vec3(values: Array) -> Vec3:
    return (float(values[0]), float(values[1]), float(values[2]))
