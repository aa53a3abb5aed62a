"""Old-town houses: pierced facades, windows with shutters, shop fronts, roofs, market stalls.

A facade is made in its own frame: x along the street, y up, the street on +z, the wall's face in z = 0.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modelling.mesh import Part, merge, surface, uv_moved
from modelling.solids import box, panel, quad

PLASTER, STONE, WOOD, ROOF = 4.0, 2.0, 1.6, 2.0


@dataclass(frozen=True)
class Opening:
    """A rectangular hole in a facade: left, right, bottom, top, and how deep the room behind it is."""

    left: float
    right: float
    low: float
    high: float
    depth: float = 0.24


def pierced_wall(width: float, height: float, openings: Sequence[Opening]) -> tuple[Part, Part]:
    """The wall from x = -width/2 to width/2 around `openings`, and their reveals."""
    xs = np.unique([-width / 2, width / 2, *(o.left for o in openings), *(o.right for o in openings)])
    ys = np.unique([0.0, height, *(o.low for o in openings), *(o.high for o in openings)])
    wall, reveals = [], []
    for x0, x1 in itertools.pairwise(xs):
        for y0, y1 in itertools.pairwise(ys):
            x, y = (x0 + x1) / 2, (y0 + y1) / 2
            if not any(o.left < x < o.right and o.low < y < o.high for o in openings):
                wall.append(panel(x0, x1, y0, y1, 0, PLASTER))
    for o in openings:
        room = box((o.left, o.low, -o.depth), (o.right, o.high, 0), PLASTER, skip="-z +z")
        reveals.append(Part(room.position, -room.normal, room.uv, room.index[:, ::-1]))
    return merge(wall), merge(reveals)


def casement(width: float, height: float) -> Part:
    """Frame and glazing bars of a window, x from -width/2, y from 0, standing in z = 0..0.04."""
    bar, half, deep = 0.028, width / 2, 0.04
    uprights = [(-half, 2 * bar - half), (-bar, bar), (half - 2 * bar, half)]
    parts = [box((a, 0, 0), (b, height, deep), WOOD, skip="-z -y +y") for a, b in uprights]
    for y in (bar, 0.66 * height, height - bar):
        parts.append(box((-half, y - bar, 0), (half, y + bar, deep - 0.005), WOOD, skip="-z -x +x"))
    return merge(parts)


def shutter(width: float, height: float) -> Part:
    """A louvred shutter hinged on x = 0, folded along +x, its front on +z."""
    slats = [
        box((0.06, y, -0.012), (width - 0.06, y + 0.08, 0.03), WOOD, skip="-z -x +x -y")
        for y in np.arange(0.1, height - 0.12, 0.17)
    ]
    return merge([box((0, 0, -0.02), (width, height, 0.015), WOOD), *slats])


def trim(o: Opening) -> Part:
    """Stone sill and lintel of a window."""
    return merge(
        [
            box((o.left - 0.14, o.low - 0.1, -0.05), (o.right + 0.14, o.low, 0.14), STONE),
            box((o.left - 0.1, o.high, -0.02), (o.right + 0.1, o.high + 0.16, 0.05), STONE, skip="-z"),
        ]
    )


def window_box(o: Opening) -> Part:
    """A wooden flower box under a window."""
    return box((o.left - 0.05, o.low - 0.02, 0.02), (o.right + 0.05, o.low + 0.17, 0.24), WOOD)


def cornice(width: float, y: float) -> Part:
    """The moulding under the eaves."""
    steps = ((0.0, 0.12, 0.06), (0.12, 0.2, 0.12), (0.2, 0.32, 0.22))
    return merge([box((-width / 2, y + a, -0.02), (width / 2, y + b, out), STONE, skip="-z") for a, b, out in steps])


def gable_roof(width: float, depth: float, y: float, rise: float) -> tuple[Part, Part]:
    """A roof with its ridge along the street: the tiled slopes, and the gables' triangles."""
    eave, half = 0.5, width / 2
    drop = rise * eave / (depth / 2)
    slopes = [
        quad(
            (-half, y - drop, eave),
            (half, y - drop, eave),
            (half, y + rise, -depth / 2),
            (-half, y + rise, -depth / 2),
            ROOF,
        ),
        quad(
            (half, y - drop, -depth - eave),
            (-half, y - drop, -depth - eave),
            (-half, y + rise, -depth / 2),
            (half, y + rise, -depth / 2),
            ROOF,
        ),
        box((-half, y - drop - 0.09, eave - 0.03), (half, y - drop + 0.02, eave + 0.05), ROOF),
    ]
    gables = []
    for x in (-half, half):
        a, b, c = (x, y - 0.4, 0.0), (x, y - 0.4, -depth), (x, y + rise, -depth / 2)
        gables.append(quad(a, b, c, c, PLASTER))
    return merge(slopes), merge(gables)


def awning(width: float, reach: float, dye: int, rng: np.random.Generator) -> Part:
    """A cloth roof from the wall at y = 0 down to y = -0.45 at z = `reach`, with a scalloped valance.

    `dye`: which band (of four) of the stripes texture it is cut from.
    """
    s = np.linspace(0, 1, 29)[None, :]
    t = np.linspace(0, 1, 7)[:, None]
    sag = 0.10 * np.sin(np.pi * t) * np.sin(np.pi * s * 3) ** 2 + 0.03 * np.sin(np.pi * t)
    x, y, z = (s - 0.5) * width + 0 * t, -0.45 * t - sag, reach * t + 0 * s
    v = (dye + 0.2 + 0.6 * t + 0 * s) / 4
    top = surface(np.stack([x, y, z], -1), np.stack([s * width / 1.2 + 0 * t, v], -1))
    hem = 0.2 + 0.08 * np.abs(np.sin(np.pi * s * round(width / 0.3)))
    wave = 0.02 * np.sin(2 * np.pi * s * 5 + rng.uniform(0, 6))
    rows = np.linspace(0, 1, 3)[:, None]
    valance = np.stack([(s - 0.5) * width + 0 * rows, -0.45 - hem * rows, reach + wave * rows], -1)
    v = (dye + 0.3 + 0.4 * rows + 0 * s) / 4
    return merge([top, surface(valance, np.stack([s * width / 1.2 + 0 * rows, v], -1))])


def stall(width: float, depth: float) -> tuple[Part, Part]:
    """A market table with posts: the wood, and where its goods lie (a part that is the table's top)."""
    w, d, h = width / 2, depth, 0.85
    legs = [
        box((x - 0.04, 0, z - 0.04), (x + 0.04, 2.3 - 0.35 * (z > 0.5), z + 0.04), WOOD)
        for x in (-w + 0.06, w - 0.06)
        for z in (0.06, d - 0.06)
    ]
    front = box((-w, 0.25, d - 0.05), (w, h, d), WOOD)
    top = box((-w - 0.05, h, 0), (w + 0.05, h + 0.05, d + 0.08), WOOD)
    return uv_moved(merge([*legs, front]), 0.3, 0.1), top
