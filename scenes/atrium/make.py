"""Makes atrium.glb: a two-storey colonnade round an open court.

Round arches on turned columns, groin vaults over the lower walk and oak beams over the upper one, a balustrade,
banners on rods before the columns, a fountain, shrubs in pots. Low sun comes over one roof, so most of the picture is
light that has bounced off stone and cloth. Run it from anywhere: ``python scenes/atrium/make.py [FOLDER]``.

The court is BAYS_X x BAYS_Z bays. One side of the colonnade is made in its own frame (x along it, the court on +z, the
walk behind on -z, the columns' axes in z = 0) and turned into place four times.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from modelling import textures
from modelling.arches import arch_moulding, arched_wall, groin_vault
from modelling.cloth import banner, swag
from modelling.glb import Finish, write_glb
from modelling.mesh import Part, merge, moved, scaled, turned, uv_moved
from modelling.plants import creeper, shrub
from modelling.run import run
from modelling.solids import ball, box, mitred_frame, quad, sweep, tube
from modelling.turned import STONE, amphora, baluster, column, fountain, hanging_lantern, pot

SEED = 2019
BAY, BAYS_X, BAYS_Z = 3.6, 3, 7
DEPTH = 3.9  # of the walks, from the columns' axes to the wall
WALK, UPPER = 0.45, 5.8  # heights of the two floors; the court is at 0
SPRING, TOP = 3.65, 5.45  # lower arches: where they spring from the columns, top of their wall
RAIL = 0.95
UPPER_SPRING, UPPER_TOP = 8.7, 10.5
ROOF = 11.1
THICK = 0.52
ASHLAR, PAVING, TILES, WOOD, PLASTER = 4.0, 4.0, 2.4, 1.6, 4.0  # metres a repeat

Model = list[tuple[str, Part]]


def finishes(rng: np.random.Generator) -> dict[str, Finish]:
    """Every material, textures painted."""
    stone, plaster, wood = textures.stone(rng), textures.plaster(rng), textures.wood(rng)
    return {
        "stone": Finish(texture=stone),
        "ashlar": Finish(texture=textures.ashlar(rng)),
        "vault": Finish((0.82, 0.74, 0.62), plaster),
        "stucco": Finish((0.80, 0.50, 0.27), plaster),
        "dado": Finish((0.50, 0.13, 0.09), plaster),
        "paving": Finish(texture=textures.paving(rng)),
        "tiles": Finish(texture=textures.tiles(rng)),
        "wood": Finish(texture=wood),
        "roof": Finish(texture=textures.roof(rng)),
        "clay": Finish((0.95, 0.45, 0.28), stone),
        "bronze": Finish((0.13, 0.095, 0.055)),
        "earth": Finish((0.06, 0.04, 0.025)),
        "water": Finish((0.10, 0.20, 0.22)),
        "cloth": Finish(texture=textures.cloth(rng)),
        "leaves": Finish(texture=textures.leaves(rng), masked=True),
    }


def window_of(dye: str) -> tuple[float, float, float, float]:
    """Where the cloth texture has the banner of that dye."""
    k = list(textures.DYES).index(dye)
    return (k / 4 + 0.003, 0.002, (k + 1) / 4 - 0.003, 0.998)


def plain_window(dye: str) -> tuple[float, float, float, float]:
    """A piece of the cloth texture that is all dye and no pattern."""
    u0, _, u1, _ = window_of(dye)
    return (u0 + 0.17 * (u1 - u0), 0.06, u1 - 0.17 * (u1 - u0), 0.17)


def lower_bay(rng: np.random.Generator, kind: str) -> Model:
    """One bay of the lower walk, centred on x: arch, vault, rib, back wall with a `door` or a `niche`."""
    shift = rng.uniform(0, 1, 8)
    wall = arched_wall(BAY, TOP - SPRING, 1.42, 0, THICK, 24, ASHLAR)
    archivolt = arch_moulding(
        [[(0.20, 0), (0.20, 0.05), (0.15, 0.075)], [(0.15, 0.075), (0.12, 0.045)], [(0.12, 0.045), (0.0, 0.045)], [(0, 0.045), (0, 0)]],
        1.42, 0, 24, STONE,
    )  # fmt: skip
    key = box((-0.12, 1.34, THICK / 2 - 0.02), (0.12, 1.74, THICK / 2 + 0.12), STONE)
    vault = groin_vault(BAY - 0.36, DEPTH - THICK / 2, TOP - SPRING - 0.12, 14, PLASTER)
    parts: Model = [
        ("ashlar", uv_moved(moved(wall, 0, SPRING, 0), *shift[:2])),
        ("stone", uv_moved(moved(merge([archivolt, key]), 0, SPRING, THICK / 2), *shift[2:4])),
        ("stone", uv_moved(moved(key, 0, SPRING, 0), *shift[2:4])),
        ("vault", uv_moved(moved(vault, 0, SPRING, -(DEPTH + THICK / 2) / 2), *shift[4:6])),
    ]
    back = -DEPTH - 0.3
    if kind == "door":
        opening = moved(arched_wall(BAY, TOP - WALK, 0.8, 2.1, 0.6, 16, ASHLAR), 0, WALK, back)
        frame = arch_moulding([[(0.16, 0), (0.16, 0.06)], [(0.16, 0.06), (0.03, 0.06)], [(0.03, 0.06), (0, 0)]], 0.8, 2.1, 16, STONE, 2.1)
        door = box((-0.8, WALK, back - 0.12), (0.8, WALK + 2.9, back - 0.06), WOOD, skip="-z -y")
        rails = [box((-0.8, WALK + y, back - 0.07), (0.8, WALK + y + 0.14, back - 0.02), WOOD) for y in (0.05, 1.0, 2.0)]
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
                box((-BAY / 2, WALK, back), (BAY / 2, sill, back + 0.3), ASHLAR, skip="-x +x -y -z"),
                moved(arched_wall(BAY, TOP - sill, 0.62, 1.25, 0.6, 16, ASHLAR), 0, sill, back),
            ]
        )
        parts += [
            ("dado", uv_moved(quad((-0.7, sill, back - 0.1), (0.7, sill, back - 0.1), (0.7, sill + 2, back - 0.1), (-0.7, sill + 2, back - 0.1), PLASTER), *shift[6:])),
            ("stone", box((-0.72, sill - 0.1, back - 0.1), (0.72, sill, back + 0.38), STONE)),
            ("clay", moved(amphora(1.15), 0, sill, back + 0.12)),
        ]
    parts.append(("ashlar", uv_moved(opening, *shift[:2])))
    return parts


def upper_bay(rng: np.random.Generator, kind: str) -> Model:
    """One bay of the upper walk: arch, balustrade, oak ceiling, stuccoed back wall with a `door` or shuttered window."""
    shift = rng.uniform(0, 1, 8)
    wall = arched_wall(BAY, UPPER_TOP - UPPER_SPRING, 1.5, 0, THICK - 0.06, 20, ASHLAR)
    archivolt = arch_moulding([[(0.16, 0), (0.16, 0.05)], [(0.16, 0.05), (0.02, 0.05)], [(0.02, 0.05), (0, 0)]], 1.5, 0, 20, STONE)
    count, span = 11, BAY - 0.5
    post = baluster(RAIL - 0.26, 0.085)
    posts = [moved(post, (k + 0.5) * span / count - span / 2, UPPER + 0.12, 0) for k in range(count)]
    rails = [
        box((-BAY / 2, UPPER, -0.14), (BAY / 2, UPPER + 0.12, 0.14), STONE, skip="-x +x -y"),
        box((-BAY / 2, UPPER + RAIL - 0.14, -0.11), (BAY / 2, UPPER + RAIL - 0.08, 0.11), STONE, skip="-x +x"),
        box((-BAY / 2, UPPER + RAIL - 0.08, -0.15), (BAY / 2, UPPER + RAIL, 0.15), STONE, skip="-x +x"),
    ]
    beams = [box((x - 0.08, UPPER_TOP - 0.27, -DEPTH), (x + 0.08, UPPER_TOP - 0.05, 0), WOOD, skip="+y -z +z") for x in np.linspace(-1.5, 1.5, 6)]
    turned_beams = [Part(b.position, b.normal, b.uv[:, ::-1], b.index) for b in beams]
    purlin = box((-BAY / 2, UPPER_TOP - 0.47, -DEPTH / 2 - 0.13), (BAY / 2, UPPER_TOP - 0.25, -DEPTH / 2 + 0.13), WOOD, skip="-x +x")
    purlin = Part(purlin.position, purlin.normal, purlin.uv[:, ::-1], purlin.index)
    y = UPPER_TOP - 0.05
    boards = quad((-BAY / 2, y, -DEPTH), (BAY / 2, y, -DEPTH), (BAY / 2, y, 0), (-BAY / 2, y, 0), WOOD)
    back = -DEPTH - 0.25
    sill = 0.0 if kind == "door" else 1.0
    opening = moved(arched_wall(BAY, UPPER_TOP - UPPER - sill, 0.62, 2.05 - sill, 0.5, 16, PLASTER), 0, UPPER + sill, back)
    below = box((-BAY / 2, UPPER, back), (BAY / 2, UPPER + sill, back + 0.25), PLASTER, skip="-x +x -y -z")
    surround = arch_moulding([[(0.14, 0), (0.14, 0.05)], [(0.14, 0.05), (0.0, 0.05)]], 0.62, 2.05 - sill, 16, STONE, 2.05 - sill)
    shutter = box((-0.62, UPPER + sill, back - 0.1), (0.62, UPPER + 2.7, back - 0.05), WOOD, skip="-z -y")
    dado = [box((low, UPPER, -DEPTH - 0.01), (high, UPPER + 0.9, -DEPTH + 0.015), PLASTER, skip="-z -y") for low, high in ((-BAY / 2, -0.77), (0.77, BAY / 2))]
    parts: Model = [
        ("ashlar", uv_moved(moved(wall, 0, UPPER_SPRING, 0), *shift[:2])),
        ("stone", uv_moved(moved(archivolt, 0, UPPER_SPRING, THICK / 2 - 0.03), *shift[2:4])),
        ("stone", uv_moved(merge([*posts, *rails]), *shift[2:4])),
        ("wood", uv_moved(merge([*turned_beams, purlin, boards]), *shift[4:6])),
        ("stucco", uv_moved(merge([opening, below]) if sill else opening, *shift[:2])),
        ("stone", moved(surround, 0, UPPER + sill, -DEPTH)),
        ("wood", uv_moved(shutter, *shift[6:])),
        ("dado", uv_moved(merge(dado), *shift[6:])),
    ]
    ledge = (0.1, 0.34) if sill else (0.2, 0.26)
    parts.append(("stone", box((-0.8, UPPER + sill - ledge[0], back - 0.15), (0.8, UPPER + sill + 0.01, back + ledge[1]), STONE)))
    return parts


def rib(spring: float, rise: float) -> Part:
    """The band of stone under the vault between two bays, and the pilaster it springs from on the wall."""
    turn = np.linspace(0, np.pi, 21)
    half = (DEPTH - THICK / 2) / 2
    path = np.stack([0 * turn, spring + rise * np.sin(turn), -(DEPTH + THICK / 2) / 2 + half * np.cos(turn)], axis=1)
    inward = np.stack([0 * turn, -np.sin(turn), -np.cos(turn)], axis=1)
    aside = np.tile([1.0, 0.0, 0.0], (len(turn), 1))
    band = sweep([[(-0.12, -0.22), (0.14, -0.22)], [(0.14, -0.22), (0.14, 0.22)], [(0.14, 0.22), (-0.12, 0.22)]], path, inward, aside, STONE)
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
    lower, upper = column(SPRING - WALK, 0.235), column(UPPER_SPRING - UPPER - RAIL - 0.06, 0.185, 16)
    model: Model = []
    for k in range(bays):
        x = (k - (bays - 1) / 2) * BAY
        kind = "door" if k % 2 == 1 else "niche"
        model += [(name, moved(part, x)) for name, part in lower_bay(rng, kind) + upper_bay(rng, "door" if kind == "niche" and k % 3 == 0 else "window")]
    for k in range(bays + 1):
        x = (k - bays / 2) * BAY
        model.append(("stone", uv_moved(moved(rib(SPRING, TOP - SPRING - 0.12), x), *rng.uniform(0, 1, 2))))
        if 0 < k < bays:
            model.append(("stone", uv_moved(moved(turned(lower, 90 * k), x, WALK), *rng.uniform(0, 1, 2))))
            model.append(("stone", uv_moved(moved(upper, x, UPPER + RAIL + 0.06), *rng.uniform(0, 1, 2))))
            pedestal = [
                box((x - 0.26, UPPER, -0.26), (x + 0.26, UPPER + RAIL, 0.26), STONE, skip="-y +y"),
                box((x - 0.3, UPPER, -0.3), (x + 0.3, UPPER + 0.14, 0.3), STONE, skip="-y"),
                box((x - 0.3, UPPER + RAIL - 0.06, -0.3), (x + 0.3, UPPER + RAIL + 0.06, 0.3), STONE),
            ]
            model.append(("stone", merge(pedestal)))
    return model


def corners(rng: np.random.Generator) -> Model:
    """The four corner piers, and the walks' corners behind them: vault, ceiling and outer walls."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    far = DEPTH
    model: Model = []
    for sx in (-1, 1):
        for sz in (-1, 1):
            pier = []
            for low, high, half in ((WALK, SPRING, 0.36), (UPPER, UPPER_SPRING, 0.3)):
                pier += [
                    box((-half, low, -half), (half, high, half), STONE, skip="-y +y"),
                    box((-half - 0.07, low, -half - 0.07), (half + 0.07, low + 0.35, half + 0.07), STONE, skip="-y"),
                    box((-half - 0.06, high - 0.3, -half - 0.06), (half + 0.06, high - 0.2, half + 0.06), STONE),
                    box((-half - 0.1, high - 0.12, -half - 0.1), (half + 0.1, high, half + 0.1), STONE),
                ]
            for low, high in ((SPRING, TOP), (UPPER_SPRING, UPPER_TOP)):
                pier.append(box((-THICK / 2, low, -THICK / 2), (THICK / 2, high, THICK / 2), STONE, skip="-y +y"))
            model.append(("stone", uv_moved(moved(merge(pier), sx * x, 0, sz * z), *rng.uniform(0, 1, 2))))
            middle = (sx * (x + far / 2), sz * (z + far / 2))
            vault = groin_vault(far, far, TOP - SPRING - 0.12, 14, PLASTER)
            model.append(("vault", moved(vault, middle[0], SPRING, middle[1])))
            low_x, high_x = sorted((sx * x, sx * (x + far)))
            low_z, high_z = sorted((sz * z, sz * (z + far)))
            y = UPPER_TOP - 0.05
            model.append(("wood", quad((low_x, y, low_z), (high_x, y, low_z), (high_x, y, high_z), (low_x, y, high_z), WOOD)))
            for low, high, name, metres in ((WALK, TOP, "ashlar", ASHLAR), (UPPER, UPPER_TOP, "stucco", PLASTER)):
                wall_x, wall_z = sx * (x + far), sz * (z + far)
                walls = [
                    quad((wall_x, low, low_z), (wall_x, low, high_z), (wall_x, high, high_z), (wall_x, high, low_z), metres),
                    quad((low_x, low, wall_z), (high_x, low, wall_z), (high_x, high, wall_z), (low_x, high, wall_z), metres),
                ]
                model.append((name, merge(walls)))
    return model


def floors_and_cornices() -> Model:
    """The court and its steps, the floors of the walks, string course, cornice with dentils, roof."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    model: Model = [("paving", quad((-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z), PAVING))]
    rect = np.array([(-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z)])
    face = THICK / 2

    def run_round(pieces: list[list[tuple[float, float]]], y: float, name: str) -> None:
        path, across, up = mitred_frame(rect + np.array([0, y, 0]))
        model.append((name, sweep(pieces, path, across, up, STONE, sharp=True)))

    steps = [(1.2, 0.0), (1.2, 0.15), (0.85, 0.15), (0.85, 0.3), (0.5, 0.3), (0.5, WALK), (-0.6, WALK)]
    run_round([[a, b] for a, b in zip(steps, steps[1:], strict=False)], 0, "stone")
    run_round(
        [
            [(face, 0), (face + 0.05, 0.0)], [(face + 0.05, 0.0), (face + 0.05, 0.1)], [(face + 0.05, 0.1), (face + 0.09, 0.12), (face + 0.15, 0.19)],
            [(face + 0.15, 0.19), (face + 0.2, 0.19)], [(face + 0.2, 0.19), (face + 0.2, 0.31)], [(face + 0.2, 0.31), (face + 0.05, 0.35)], [(face + 0.05, 0.35), (-0.3, 0.35)],
        ],
        TOP, "stone",
    )  # fmt: skip
    curl = np.linspace(0, np.pi / 2, 6)
    cyma = [(face + 0.34 + 0.16 * np.sin(t), 0.34 + 0.2 * (1 - np.cos(t))) for t in curl]
    run_round(
        [
            [(face - 0.03, 0), (face + 0.06, 0.0)], [(face + 0.06, 0), (face + 0.06, 0.18)], [(face + 0.06, 0.18), (face + 0.34, 0.18)],
            [(face + 0.34, 0.18), (face + 0.34, 0.34)], cyma, [cyma[-1], (face + 0.5, 0.6)], [(face + 0.5, 0.6), (0.0, 0.66)],
        ],
        UPPER_TOP, "stone",
    )  # fmt: skip
    for length, turn, off in ((2 * x, 0, z), (2 * z, 90, x), (2 * x, 180, z), (2 * z, 270, x)):
        teeth = np.arange(-length / 2 + 0.4, length / 2 - 0.35, 0.24)
        tooth = box((-0.065, UPPER_TOP + 0.06, 0.02), (0.065, UPPER_TOP + 0.18, 0.16), STONE, skip="-z +y")
        row = merge([moved(tooth, t, 0, face + 0.02) for t in teeth])
        model.append(("stone", turned(moved(row, 0, 0, -off), turn)))
    far_x, far_z = x + DEPTH, z + DEPTH
    for y in (WALK, UPPER):
        for x0, x1, z0, z1 in ((-far_x, far_x, z, far_z), (-far_x, far_x, -far_z, -z), (-far_x, -x, -z, z), (x, far_x, -z, z)):
            model.append(("tiles", quad((x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0), TILES)))
    eave, ridge = np.array([(-x, ROOF, z), (x, ROOF, z), (x, ROOF, -z), (-x, ROOF, -z)]), 12.6
    top = np.array([(-far_x - 0.4, ridge, far_z + 0.4), (far_x + 0.4, ridge, far_z + 0.4), (far_x + 0.4, ridge, -far_z - 0.4), (-far_x - 0.4, ridge, -far_z - 0.4)])
    for k in range(4):
        n = (k + 1) % 4
        model.append(("roof", quad(eave[k], eave[n], top[n], top[k], 2.0)))
    return model


def banners(rng: np.random.Generator) -> Model:
    """Banners on rods that stand out from the upper columns, festoons on the balustrades."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    order = ["red", "ochre", "blue", "red", "green", "ochre", "blue", "red"]
    model: Model = []
    rod_y, width, length = 8.35, 1.25, 4.3
    for number, (sx, turn) in enumerate(((-1, 90), (1, -90))):
        for k in range(1, BAYS_Z):
            at = (k - BAYS_Z / 2) * BAY
            dye = order[(k + 3 * number) % len(order)]
            rod = merge([tube([(0.1, 0, 0), (1.0, 0.0, 0), (1.85, 0, 0)], 0.028, 8), moved(ball(0.06, 6, 8), 1.88)])
            stay = tube([(0.15, 0.55, 0), (0.6, 0.28, 0), (1.1, 0.0, 0)], 0.01, 5)
            model.append(("bronze", moved(turned(merge([rod, stay]), 0 if sx < 0 else 180), sx * x, rod_y, at)))
            flag = banner(width, length + rng.uniform(-0.25, 0.25), rng, window_of(dye), tail=0.32 if k % 2 else -0.3)
            model.append(("cloth", moved(flag, sx * (x - 0.42 - width / 2 - 0.1), rod_y, at)))
        for k in (0, 2, 4, 6):
            at = (k - (BAYS_Z - 1) / 2) * BAY
            festoon = swag(3.0, 0.55, 0.35, rng, plain_window(order[(k + number) % 4 + 4]))
            model.append(("cloth", moved(turned(moved(festoon, 0, UPPER + RAIL - 0.02, 0.14), turn), sx * x, 0, at)))
    for k, dye in ((1, "red"), (2, "blue")):
        at = (k - BAYS_X / 2) * BAY
        rod = moved(merge([tube([(-0.85, 0, 0), (0, 0, 0), (0.85, 0, 0)], 0.03, 8), moved(ball(0.06, 6, 8), 0.88), moved(ball(0.06, 6, 8), -0.88)]), at, rod_y, -z + 0.5)
        struts = [moved(tube([(0, 0, 0.1), (0, 0, 0.3), (0, 0, 0.5)], 0.015, 5), at + dx, rod_y, -z) for dx in (-0.15, 0.15)]
        model.append(("bronze", merge([rod, *struts])))
        model.append(("cloth", moved(banner(1.5, 4.6, rng, window_of(dye), tail=-0.35, folds=2.0), at, rod_y, -z + 0.5)))
    for sz, turn in ((-1, 0), (1, 180)):
        festoon = swag(3.0, 0.6, 0.4, rng, plain_window("ochre"))
        model.append(("cloth", turned(moved(festoon, 0, UPPER + RAIL - 0.02, 0.14 - z), turn)))
    return model


def furniture(rng: np.random.Generator) -> Model:
    """Fountain, shrubs in pots, creepers over the balustrade, lanterns in the arches, jars."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    stone, water = fountain(1.45)
    model: Model = [("stone", moved(stone, 0, 0, 0.5)), ("water", moved(water, 0, 0, 0.5))]
    for sx in (-1, 1):
        for k in range(1, BAYS_Z):
            at = (k - BAYS_Z / 2) * BAY
            if k % 2 == (sx > 0):
                size = rng.uniform(0.9, 1.15)
                vessel, earth = pot(0.36, 0.62)
                bush = moved(shrub(1.35, 0.62, 110, rng), 0, 0.42, 0)
                place = (sx * (x - 1.62), 0.0, at)
                for name, part in (("clay", vessel), ("earth", earth), ("leaves", bush)):
                    model.append((name, moved(turned(scaled(part, size), rng.uniform(0, 360)), *place)))
        for k in range(0, BAYS_Z, 2):
            at = (k - (BAYS_Z - 1) / 2) * BAY
            model.append(("bronze", moved(hanging_lantern(1.15), sx * x, SPRING + 1.42, at)))
        for at in rng.uniform(-z + 1, z - 1, 5):
            vine = turned(moved(creeper(rng.uniform(0.9, 2.2), 70, rng, 0.22), 0, TOP + 0.38, 0.47), -90 * sx)
            model.append(("leaves", moved(vine, sx * x, 0, at)))
    for at in (-BAY, 0, BAY):
        model.append(("bronze", moved(hanging_lantern(1.15), at, SPRING + 1.42, -z)))
    for px, pz, size in ((-4.75, 9.6, 1.0), (-4.9, 8.9, 0.75), (4.8, -5.1, 1.0), (4.7, -8.6, 0.8), (-4.8, -3.3, 0.9)):
        model.append(("clay", moved(turned(amphora(size), rng.uniform(0, 360)), px, WALK, pz)))
    return model


def model(rng: np.random.Generator) -> Model:
    """The whole building; the court's centre at the origin, its length along z."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    parts: Model = []
    for bays, degrees, off in ((BAYS_X, 0, z), (BAYS_Z, 90, x), (BAYS_X, 180, z), (BAYS_Z, 270, x)):
        parts += [(name, turned(moved(part, 0, 0, -off), degrees)) for name, part in side(bays, rng)]
    return parts + corners(rng) + floors_and_cornices() + banners(rng) + furniture(rng)


def make(folder: Path) -> str:
    """Writes atrium.glb into `folder`."""
    rng = np.random.default_rng(SEED)
    materials = finishes(rng)
    return f"atrium.glb: {write_glb(folder / 'atrium.glb', model(rng), materials)} triangles"


if __name__ == "__main__":
    run(make, __file__)
