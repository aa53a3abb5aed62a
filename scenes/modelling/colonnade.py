"""One side of a two-storey colonnade: bays with arches, vaults, a balustrade, beams and a wall behind.

A side is made in its own frame: x along it, the court on +z, the walk behind on -z, the columns' axes in z = 0.
"""

from __future__ import annotations

import numpy as np

from modelling.arches import arch_moulding, arched_wall, groin_vault
from modelling.mesh import Model, Part, merge, moved, placed, repeatable, turned, uv_moved
from modelling.solids import ball, box, facets, panel, quad, sweep
from modelling.turned import STONE, amphora, baluster, column

BAY = 3.6
DEPTH = 3.9  # of the walks, from the columns' axes to the wall
WALK, UPPER = 0.45, 5.8  # heights of the two floors; the court is at 0
SPRING, TOP = 3.65, 5.45  # lower arches: where they spring from the columns, top of their wall
RAIL = 0.95
UPPER_SPRING, UPPER_TOP = 8.7, 10.5
THICK = 0.52
ASHLAR, WOOD, PLASTER = 4.0, 1.6, 4.0  # metres a repeat


def _row_of_balusters(count: int = 11, span: float = BAY - 0.5) -> Part:
    post = baluster(RAIL - 0.26, 0.085)
    return merge([moved(post, (k + 0.5) * span / count - span / 2) for k in range(count)])


LOWER_COLUMN = repeatable(column(SPRING - WALK, 0.235))
UPPER_COLUMN = repeatable(column(UPPER_SPRING - UPPER - RAIL - 0.06, 0.185, 16))
BALUSTERS = repeatable(_row_of_balusters())
JAR = repeatable(amphora(1.15))


def lower_bay(rng: np.random.Generator, kind: str) -> Model:
    """One bay of the lower walk, centred on x: arch, vault, rib, back wall with a `door` or a `niche`."""
    shift = rng.uniform(0, 1, 8)
    wall = arched_wall(BAY, TOP - SPRING, 1.42, 0, THICK, 24, ASHLAR)
    bands = [[(0.20, 0), (0.20, 0.05), (0.15, 0.075)], *facets((0.15, 0.075), (0.12, 0.045), (0.0, 0.045), (0, 0))]
    archivolt = arch_moulding(bands, 1.42, 0, 24, STONE)
    key = box((-0.12, 1.34, THICK / 2 - 0.02), (0.12, 1.74, THICK / 2 + 0.12), STONE)
    vault = groin_vault(BAY - 0.36, DEPTH - THICK / 2, TOP - SPRING - 0.12, 14, PLASTER)
    parts: Model = [
        ("ashlar", uv_moved(moved(wall, 0, SPRING, 0), *shift[:2])),
        ("stone", uv_moved(moved(archivolt, 0, SPRING, THICK / 2), *shift[2:4])),
        ("stone", uv_moved(moved(key, 0, SPRING, 0), *shift[2:4])),
        ("vault", uv_moved(moved(vault, 0, SPRING, -(DEPTH + THICK / 2) / 2), *shift[4:6])),
    ]
    back = -DEPTH - 0.3
    if kind == "door":
        opening = moved(arched_wall(BAY, TOP - WALK, 0.8, 2.1, 0.6, 16, ASHLAR), 0, WALK, back)
        frame = arch_moulding(facets((0.16, 0), (0.16, 0.06), (0.03, 0.06), (0, 0)), 0.8, 2.1, 16, STONE, 2.1)
        door = box((-0.82, WALK, back - 0.12), (0.82, WALK + 2.9, back - 0.06), WOOD, skip="-z -y")
        rails = [
            box((-0.8, WALK + y, back - 0.07), (0.8, WALK + y + 0.14, back - 0.02), WOOD) for y in (0.05, 1.0, 2.0)
        ]
        parts += [
            ("stone", uv_moved(moved(frame, 0, WALK, back + 0.3), *shift[6:])),
            ("wood", uv_moved(merge([door, *rails]), *shift[6:])),
            ("bronze", moved(ball(0.05, 6, 8), 0.5, WALK + 1.15, back - 0.02)),
            ("stone", box((-0.95, WALK - 0.2, back - 0.2), (0.95, WALK + 0.02, back + 0.34), STONE, skip="-y")),
        ]
    else:
        sill = WALK + 0.75
        opening = merge(
            [
                box((-BAY / 2, WALK, back), (BAY / 2, sill, back + 0.3), ASHLAR, skip="-x +x -y +y -z"),
                moved(arched_wall(BAY, TOP - sill, 0.62, 1.25, 0.6, 16, ASHLAR), 0, sill, back),
            ]
        )
        parts += [
            ("dado", uv_moved(panel(-0.7, 0.7, sill, sill + 2, back - 0.1, PLASTER), *shift[6:])),
            ("stone", box((-0.72, sill - 0.1, back - 0.11), (0.72, sill + 0.01, back + 0.38), STONE)),
        ]
    parts.append(("ashlar", uv_moved(opening, *shift[:2])))
    return parts


def upper_bay(rng: np.random.Generator, kind: str) -> Model:
    """One bay of the upper walk: arch, balustrade, oak ceiling, stuccoed wall with a `door` or a window."""
    shift = rng.uniform(0, 1, 8)
    wall = arched_wall(BAY, UPPER_TOP - UPPER_SPRING, 1.5, 0, THICK - 0.06, 20, ASHLAR)
    archivolt = arch_moulding(facets((0.16, 0), (0.16, 0.05), (0.02, 0.05), (0, 0)), 1.5, 0, 20, STONE)
    rails = [
        box((-BAY / 2, UPPER, -0.14), (BAY / 2, UPPER + 0.12, 0.14), STONE, skip="-x +x -y"),
        box((-BAY / 2, UPPER + RAIL - 0.14, -0.11), (BAY / 2, UPPER + RAIL - 0.08, 0.11), STONE, skip="-x +x"),
        box((-BAY / 2, UPPER + RAIL - 0.08, -0.15), (BAY / 2, UPPER + RAIL, 0.15), STONE, skip="-x +x"),
    ]
    beams = [
        box((x - 0.08, UPPER_TOP - 0.27, -DEPTH), (x + 0.08, UPPER_TOP - 0.05, 0), WOOD, skip="+y -z +z")
        for x in np.linspace(-1.5, 1.5, 6)
    ]
    turned_beams = [Part(b.position, b.normal, b.uv[:, ::-1], b.index) for b in beams]
    purlin = box(
        (-BAY / 2, UPPER_TOP - 0.47, -DEPTH / 2 - 0.13),
        (BAY / 2, UPPER_TOP - 0.25, -DEPTH / 2 + 0.13),
        WOOD,
        skip="-x +x",
    )
    purlin = Part(purlin.position, purlin.normal, purlin.uv[:, ::-1], purlin.index)
    y = UPPER_TOP - 0.05
    boards = quad((-BAY / 2, y, -DEPTH), (BAY / 2, y, -DEPTH), (BAY / 2, y, 0), (-BAY / 2, y, 0), WOOD)
    back = -DEPTH - 0.25
    sill = 0.0 if kind == "door" else 1.0
    opening = moved(
        arched_wall(BAY, UPPER_TOP - UPPER - sill, 0.62, 2.05 - sill, 0.5, 16, PLASTER), 0, UPPER + sill, back
    )
    below = box((-BAY / 2, UPPER, back), (BAY / 2, UPPER + sill, back + 0.25), PLASTER, skip="-x +x -y +y -z")
    surround = arch_moulding(facets((0.14, 0), (0.14, 0.05), (0.0, 0.05)), 0.62, 2.05 - sill, 16, STONE, 2.05 - sill)
    shutter = box((-0.64, UPPER + sill, back - 0.1), (0.64, UPPER + 2.7, back - 0.05), WOOD, skip="-z -y")
    dado = [
        box((low, UPPER, -DEPTH - 0.01), (high, UPPER + 0.9, -DEPTH + 0.015), PLASTER, skip="-z -y")
        for low, high in ((-BAY / 2 + 0.001, -0.77), (0.77, BAY / 2 - 0.001))
    ]
    parts: Model = [
        ("ashlar", uv_moved(moved(wall, 0, UPPER_SPRING, 0), *shift[:2])),
        ("stone", uv_moved(moved(archivolt, 0, UPPER_SPRING, THICK / 2 - 0.03), *shift[2:4])),
        ("stone", uv_moved(merge(rails), *shift[2:4])),
        ("wood", uv_moved(merge([*turned_beams, purlin, boards]), *shift[4:6])),
        ("stucco", uv_moved(merge([opening, below]) if sill else opening, *shift[:2])),
        ("stone", moved(surround, 0, UPPER + sill, -DEPTH)),
        ("wood", uv_moved(shutter, *shift[6:])),
        ("dado", uv_moved(merge(dado), *shift[6:])),
    ]
    ledge = (0.1, 0.34) if sill else (0.2, 0.26)
    parts.append(
        ("stone", box((-0.8, UPPER + sill - ledge[0], back - 0.15), (0.8, UPPER + sill + 0.01, back + ledge[1]), STONE))
    )
    return parts


def rib(spring: float, rise: float) -> Part:
    """The band of stone under the vault between two bays, and the pilaster it springs from on the wall."""
    turn = np.linspace(0, np.pi, 21)
    half = (DEPTH - THICK / 2) / 2
    path = np.stack([0 * turn, spring + rise * np.sin(turn), -(DEPTH + THICK / 2) / 2 + half * np.cos(turn)], axis=1)
    inward = np.stack([0 * turn, -np.sin(turn), -np.cos(turn)], axis=1)
    aside = np.tile([1.0, 0.0, 0.0], (len(turn), 1))
    band = sweep(
        facets((-0.12, -0.22), (0.14, -0.22), (0.14, 0.22), (-0.12, 0.22)),
        path,
        inward,
        aside,
        STONE,
    )
    z = -DEPTH
    pilaster = [
        box((-0.24, WALK, z), (0.24, spring - 0.22, z + 0.14), STONE, skip="-y -z"),
        box((-0.29, WALK, z), (0.29, WALK + 0.3, z + 0.19), STONE, skip="-y -z"),
        box((-0.27, spring - 0.3, z), (0.27, spring - 0.22, z + 0.17), STONE, skip="-z"),
        box((-0.33, spring - 0.22, z), (0.33, spring, z + 0.24), STONE, skip="-z"),
    ]
    return merge([band, *pilaster])


def side(bays: int, rng: np.random.Generator) -> Model:
    """One side of the colonnade, without its corners, in its own frame."""
    model: Model = []
    for k in range(bays):
        x = (k - (bays - 1) / 2) * BAY
        kind = "door" if k % 2 == 1 else "niche"
        behind = "door" if kind == "niche" and k % 3 == 0 else "window"
        model += placed(lower_bay(rng, kind) + upper_bay(rng, behind), x)
        model.append(("stone", moved(BALUSTERS, x, UPPER + 0.12)))
        if kind == "niche":
            model.append(("clay", moved(JAR, x, WALK + 0.75, -DEPTH - 0.18)))
    for k in range(bays + 1):
        x = (k - bays / 2) * BAY
        model.append(("stone", uv_moved(moved(rib(SPRING, TOP - SPRING - 0.12), x), *rng.uniform(0, 1, 2))))
        if 0 < k < bays:
            model.append(("stone", moved(turned(LOWER_COLUMN, 90 * k), x, WALK)))
            model.append(("stone", moved(turned(UPPER_COLUMN, 90 * k), x, UPPER + RAIL + 0.06)))
            pedestal = [
                box((x - 0.26, UPPER, -0.26), (x + 0.26, UPPER + RAIL, 0.26), STONE, skip="-y +y"),
                box((x - 0.3, UPPER, -0.3), (x + 0.3, UPPER + 0.14, 0.3), STONE, skip="-y"),
                box((x - 0.3, UPPER + RAIL - 0.06, -0.3), (x + 0.3, UPPER + RAIL + 0.06, 0.3), STONE),
            ]
            model.append(("stone", merge(pedestal)))
    return model
