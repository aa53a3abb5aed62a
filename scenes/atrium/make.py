"""Makes atrium.glb: a two-storey colonnade round an open court.

Round arches on turned columns, groin vaults over the lower walk and oak beams over the upper one, a balustrade,
banners on rods before the columns, a fountain, shrubs in pots. Low sun comes over one roof, so most of the picture is
light that has bounced off stone and cloth. Run it from anywhere: ``python scenes/atrium/make.py [FOLDER]``.

The court is BAYS_X x BAYS_Z bays; each of its four sides is a colonnade (modelling/colonnade.py) turned into place.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from modelling import textures
from modelling.arches import groin_vault
from modelling.cloth import banner, swag
from modelling.colonnade import (
    ASHLAR,
    BAY,
    DEPTH,
    JAR,
    PLASTER,
    RAIL,
    SPRING,
    THICK,
    TOP,
    UPPER,
    UPPER_SPRING,
    UPPER_TOP,
    WALK,
    WOOD,
    side,
)
from modelling.glb import Finish, write_glb
from modelling.mesh import Model, merge, moved, repeatable, scaled, turned, uv_moved
from modelling.plants import creeper, shrub
from modelling.run import run
from modelling.solids import ball, box, facets, mitred_frame, quad, sweep, tube
from modelling.turned import STONE, fountain, hanging_lantern, pot

SEED = 2019
BAYS_X, BAYS_Z = 3, 7
EAVE, RIDGE = 11.1, 12.6
PAVING, TILES, ROOF = 4.0, 2.4, 2.0  # metres a repeat

LANTERN = repeatable(hanging_lantern(1.15))
POT = repeatable(pot(0.36, 0.62)[0])


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
            model.append(
                ("wood", quad((low_x, y, low_z), (high_x, y, low_z), (high_x, y, high_z), (low_x, y, high_z), WOOD))
            )
            for low, high, name, metres in ((WALK, TOP, "ashlar", ASHLAR), (UPPER, UPPER_TOP, "stucco", PLASTER)):
                wall_x, wall_z = sx * (x + far), sz * (z + far)
                a, b, c, d = (wall_x, low_z), (wall_x, high_z), (low_x, wall_z), (high_x, wall_z)
                walls = [
                    quad((p[0], low, p[1]), (q[0], low, q[1]), (q[0], high, q[1]), (p[0], high, p[1]), metres)
                    for p, q in ((a, b), (c, d))
                ]
                model.append((name, merge(walls)))
    return model


def floors_and_cornices() -> Model:
    """The court and its steps, the floors of the walks, string course, cornice with dentils, roof."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    model: Model = [("paving", quad((-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z), PAVING))]
    rect = np.array([(-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z)])
    face = THICK / 2

    def run_round(pieces: list[list[tuple[float, float]]], y: float) -> None:
        path, across, up = mitred_frame(rect + np.array([0, y, 0]))
        model.append(("stone", sweep(pieces, path, across, up, STONE, sharp=True)))

    run_round(facets((1.2, 0.0), (1.2, 0.15), (0.85, 0.15), (0.85, 0.3), (0.5, 0.3), (0.5, WALK), (0.0, WALK)), 0)
    a = face
    string_course = [
        *facets((a, 0), (a + 0.05, 0.0), (a + 0.05, 0.1)),
        [(a + 0.05, 0.1), (a + 0.09, 0.12), (a + 0.15, 0.19)],
        *facets((a + 0.15, 0.19), (a + 0.2, 0.19), (a + 0.2, 0.31), (a + 0.05, 0.35), (0.0, 0.35)),
    ]
    run_round(string_course, TOP)
    cyma = [(a + 0.34 + 0.16 * np.sin(t), 0.34 + 0.2 * (1 - np.cos(t))) for t in np.linspace(0, np.pi / 2, 6)]
    cornice = [
        *facets((a - 0.03, 0), (a + 0.06, 0.0), (a + 0.06, 0.18), (a + 0.34, 0.18), (a + 0.34, 0.34)),
        cyma,
        *facets(cyma[-1], (a + 0.5, 0.6), (0.0, 0.66)),
    ]
    run_round(cornice, UPPER_TOP)
    for length, turn, off in ((2 * x, 0, z), (2 * z, 90, x), (2 * x, 180, z), (2 * z, 270, x)):
        teeth = np.arange(-length / 2 + 0.4, length / 2 - 0.35, 0.24)
        tooth = box((-0.065, UPPER_TOP + 0.06, 0.02), (0.065, UPPER_TOP + 0.18, 0.16), STONE, skip="-z +y")
        row = merge([moved(tooth, t, 0, face + 0.02) for t in teeth])
        model.append(("stone", turned(moved(row, 0, 0, -off), turn)))
    far_x, far_z = x + DEPTH, z + DEPTH
    for y in (WALK, UPPER):
        for x0, x1, z0, z1 in (
            (-far_x, far_x, z, far_z),
            (-far_x, far_x, -far_z, -z),
            (-far_x, -x, -z, z),
            (x, far_x, -z, z),
        ):
            model.append(("tiles", quad((x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0), TILES)))
    signs = np.array([(-1, 1, 1), (1, 1, 1), (1, 1, -1), (-1, 1, -1)])
    eave, top = signs * [x, EAVE, z], signs * [far_x + 0.4, RIDGE, far_z + 0.4]
    for k in range(4):
        n = (k + 1) % 4
        model.append(("roof", quad(eave[k], eave[n], top[n], top[k], ROOF)))
    return model


def banners(rng: np.random.Generator) -> Model:
    """Banners on rods that stand out from the upper columns, festoons on the balustrades."""
    x, z = BAYS_X * BAY / 2, BAYS_Z * BAY / 2
    left, right = ["red", "ochre", "blue", "green", "red"], ["red", "ochre", "green", "red", "blue", "red"]
    model: Model = []
    rod_y, width, length = 8.35, 1.25, 4.3
    for sx, turn, dyes in ((-1, 90, left), (1, -90, right)):
        for k, dye in enumerate(dyes, 1):
            at = (k - BAYS_Z / 2) * BAY
            rod = merge([tube([(0.1, 0, 0), (1.0, 0.0, 0), (1.85, 0, 0)], 0.028, 8), moved(ball(0.06, 6, 8), 1.88)])
            stay = tube([(0.15, 0.55, 0), (0.6, 0.28, 0), (1.1, 0.0, 0)], 0.01, 5)
            model.append(("bronze", moved(turned(merge([rod, stay]), 0 if sx < 0 else 180), sx * x, rod_y, at)))
            flag = banner(width, length + rng.uniform(-0.25, 0.25), rng, window_of(dye), tail=0.32 if k % 2 else -0.3)
            model.append(("cloth", moved(flag, sx * (x - 0.42 - width / 2 - 0.1), rod_y, at)))
        for k in (0, 2, 4, 6):
            at = (k - (BAYS_Z - 1) / 2) * BAY
            festoon = swag(3.0, 0.55, 0.35, rng, plain_window(dyes[k // 2 + 1]))
            model.append(("cloth", moved(turned(moved(festoon, 0, UPPER + RAIL - 0.02, 0.14), turn), sx * x, 0, at)))
    for k, dye in ((1, "red"), (2, "blue")):
        at = (k - BAYS_X / 2) * BAY
        rod = moved(
            merge(
                [
                    tube([(-0.85, 0, 0), (0, 0, 0), (0.85, 0, 0)], 0.03, 8),
                    moved(ball(0.06, 6, 8), 0.88),
                    moved(ball(0.06, 6, 8), -0.88),
                ]
            ),
            at,
            rod_y,
            -z + 0.5,
        )
        struts = [
            moved(tube([(0, 0, 0.1), (0, 0, 0.3), (0, 0, 0.5)], 0.015, 5), at + dx, rod_y, -z) for dx in (-0.15, 0.15)
        ]
        model.append(("bronze", merge([rod, *struts])))
        model.append(
            ("cloth", moved(banner(1.5, 4.6, rng, window_of(dye), tail=-0.35, folds=2.0), at, rod_y, -z + 0.5))
        )
    for turn in (0, 180):
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
            if k % 2 == (sx > 0) and k < BAYS_Z - 1:
                size = rng.uniform(0.9, 1.15)
                vessel, earth = POT, pot(0.36, 0.62)[1]
                bush = moved(shrub(1.35, 0.62, 110, rng), 0, 0.18, 0)
                place = (sx * (x - 1.62), 0.0, at)
                for name, part in (("clay", vessel), ("earth", earth), ("leaves", bush)):
                    model.append((name, moved(turned(scaled(part, size), rng.uniform(0, 360)), *place)))
        for k in range(0, BAYS_Z, 2):
            at = (k - (BAYS_Z - 1) / 2) * BAY
            model.append(("bronze", moved(LANTERN, sx * x, SPRING + 1.42, at)))
        for at in rng.uniform(-z + 1, z - 1, 5):
            vine = turned(moved(creeper(rng.uniform(0.9, 2.2), 52, rng, 0.22), 0, TOP + 0.38, 0.47), -90 * sx)
            model.append(("leaves", moved(vine, sx * x, 0, at)))
    for at in (-BAY, 0, BAY):
        model.append(("bronze", moved(LANTERN, at, SPRING + 1.42, -z)))
    for px, pz, size in ((-4.75, 9.6, 1.0), (-4.9, 8.9, 0.75), (4.8, -5.1, 1.0), (4.7, -8.6, 0.8), (-4.8, -3.3, 0.9)):
        model.append(("clay", moved(turned(scaled(JAR, size / 1.15), rng.uniform(0, 360)), px, WALK, pz)))
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
