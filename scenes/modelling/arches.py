"""Round arches: walls with an arched opening, mouldings around it, groin vaults behind it."""

from __future__ import annotations

import numpy as np

from modelling.mesh import Part, box_mapped, merge, surface
from modelling.solids import Pieces, box, sweep

Z = np.array([0.0, 0.0, 1.0])


def _semicircle(radius: float, springing: float, segments: int) -> np.ndarray:
    """(segments + 1, 3) points from left to right over the top."""
    turn = np.linspace(np.pi, 0, segments + 1)
    return np.stack([radius * np.cos(turn), springing + radius * np.sin(turn), 0 * turn], axis=1)


def arched_wall(
    width: float, height: float, opening: float, springing: float, thickness: float, segments: int = 20,
    metres: float = 1.0,
) -> Part:  # fmt: skip
    """A wall in the plane x-y, centred on x, from y = 0 to `height`, with an opening of half width `opening`.

    The opening has straight jambs up to `springing` (0: an arch on columns) and a semicircle above.
    Open at its ends and top.
    """
    arch = _semicircle(opening, springing, segments)
    head = arch.copy()
    head[:, 1] = height
    half, parts = thickness / 2, []
    for side in (1.0, -1.0):
        offset = side * half * Z
        strip = np.stack([arch, head]) + offset
        parts.append(box_mapped(surface(strip, np.zeros((*strip.shape[:2], 2)), flip=side > 0), metres))
        name = "+z" if side > 0 else "-z"
        others = " ".join({"-x", "+x", "-y", "+y", "-z", "+z"} - {name})
        for low, high in ((-width / 2, -opening), (opening, width / 2)):
            parts.append(box((low, 0, -half), (high, height, half), metres, skip=others))
    length = np.linspace(0, np.pi * opening, segments + 1) / metres
    depth = np.array([-half, half])[:, None] / metres
    uv = np.stack(np.broadcast_arrays(length, depth), axis=-1)
    parts.append(surface(np.stack([arch - half * Z, arch + half * Z]), uv, flip=True))
    if springing > 0:
        parts.append(box((-opening, 0, -half), (opening, springing, half), metres, skip="-y +y -z +z"))
        jambs = parts.pop()
        parts.append(Part(jambs.position, -jambs.normal, jambs.uv, jambs.index[:, [0, 2, 1]]))
    soles = [(-width / 2, -opening), (opening, width / 2)]
    for low, high in soles:
        parts.append(box((low, 0, -half), (high, 1, half), metres, skip="-x +x +y -z +z"))
    return merge(parts)


def arch_moulding(
    pieces: Pieces, radius: float, springing: float, segments: int = 20, metres: float = 1.0, jamb: float = 0.0
) -> Part:
    """A moulding round an arch on the wall's +z face: `pieces` of (outward from the opening, out of the wall).

    `jamb` > 0 runs it on down the jambs by that length.
    """
    path = _semicircle(radius, springing, segments)
    outward = (path - np.array([0, springing, 0])) / radius
    if jamb > 0:
        ends = path[[0, -1]] - np.array([0, jamb, 0])
        path = np.concatenate([ends[:1], path, ends[1:]])
        outward = np.concatenate([outward[:1], outward, outward[-1:]])
    return sweep(pieces, path, outward, np.tile(Z, (len(path), 1)), metres)


def groin_vault(width: float, depth: float, rise: float, segments: int = 14, metres: float = 1.0) -> Part:
    """A cross vault over a bay centred at the origin, springing at y = 0; its front is below.

    Two half-elliptic barrels meet; each of the four webs is a smooth patch and the groins are sharp.
    """
    turn = np.linspace(-np.pi / 2, np.pi / 2, segments + 1)
    aside, height = np.sin(turn), np.cos(turn)
    rows = np.linspace(0, 1, max(3, segments // 3))
    parts = []
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            along = sign * (np.abs(aside) + rows[:, None] * (1 - np.abs(aside)))
            across = np.broadcast_to(aside, along.shape)
            x, z = (across, along) if axis == 0 else (along, across)
            points = np.stack([x * width / 2, np.broadcast_to(height * rise, x.shape), z * depth / 2], axis=-1)
            length = np.broadcast_to(turn * (width if axis == 0 else depth) / 2, x.shape)
            uv = np.stack([length / metres, along * (depth if axis == 0 else width) / 2 / metres], axis=-1)
            parts.append(surface(points, uv, flip=(sign > 0) == (axis == 0)))
    return merge(parts)
