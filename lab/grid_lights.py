"""One grid light as a shape: its level, the shells of its blending, its emission; and the cells a level fills."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import LabError
from lab.params import Params
from lab.records import Floats, Hierarchy, as_rows


def level_of(hierarchy: Hierarchy, index: int) -> int:
    """The level of merged index `index`.

    Errors: :class:`LabError` where there is no such light.
    """
    count = len(hierarchy.position)
    if not 0 <= index < count:
        raise LabError(f"light {index}: merged indices of this hierarchy go from 0 to {count - 1}")
    return int(np.searchsorted(hierarchy.offset, index, side="right")) - 1


def blend_shells(hierarchy: Hierarchy, params: Params, level: int) -> dict[str, float]:
    """Radii, by name, where the blend weight B of lights of `level` bends (LY19 3.2); lengths of the scene.

    ``r/2`` where the ramp up begins (not of the first drawn level, which has none), ``r`` = alpha h_l where B is 1,
    ``2r`` where the ramp down ends (not of the top, which has none). A level that is not drawn has no shells.
    """
    if not 0 <= level <= hierarchy.top:
        raise LabError(f"level {level}: this hierarchy has levels 0 to {hierarchy.top}")
    if level < params.first_level:
        return {}
    radius = params.alpha * float(hierarchy.cell_size[level])
    shells = {"r/2": radius / 2, "r": radius, "2r": 2 * radius}
    if level == params.first_level:
        del shells["r/2"]
    if level == hierarchy.top:
        del shells["2r"]
    return shells


def emission(hierarchy: Hierarchy, index: int, directions: ArrayLike, params: Params | None = None) -> Floats:
    """What light `index` emits toward (n, 3) unit `directions`, in its lobe ``params.lobe`` (LY19 3.2).

    Returns (n,) values relative to flux / pi: 1 along the normal of a single Lambertian light, 1/4 of an isotropic one.
    """
    from lab import _core

    level_of(hierarchy, index)
    toward = as_rows("directions", directions, 3)
    if (np.abs(np.linalg.norm(toward, axis=1) - 1) > 1e-3).any():
        raise LabError("directions: every row must have length 1")
    row = slice(index, index + 1)
    moments = hierarchy.normal[row], hierarchy.normal_moment[row]
    return _core.emission(toward, (params or Params()).lobe, *moments, bool(hierarchy.oriented[index]))


def relative_deviation(hierarchy: Hierarchy) -> Floats:
    """(m,) length of each light's position deviation over its level's cell size h_l."""
    sizes = np.repeat(hierarchy.cell_size, np.diff(hierarchy.offset))
    return np.asarray(np.linalg.norm(hierarchy.deviation, axis=1) / sizes, np.float32)


def occupied_cells(hierarchy: Hierarchy, level: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cells of a grid level that hold input lights: (c, 3) lowest vertices and (c,) how many lights they hold.

    Cell (i, j, k) reaches from ``origin + (i, j, k) * h`` to ``origin + (i + 1, j + 1, k + 1) * h``. In grid order, x
    fastest. Level 0 has no grid of its own and is refused.
    """
    if not 1 <= level <= hierarchy.top:
        raise LabError(f"cells of level {level}: the grids of this hierarchy are levels 1 to {hierarchy.top}")
    # All grids share a corner, so a cell of level l is 2^(l-1) cells of level 1 wide.
    finest = hierarchy.vertex[: hierarchy.offset[1]].astype(np.int64)
    side = np.int64(2) ** (hierarchy.top - level)
    x, y, z = (finest >> (level - 1)).T
    keys, lights = np.unique(x + side * (y + side * z), return_counts=True)
    return np.stack([keys % side, keys // side % side, keys // side**2], axis=1), lights
