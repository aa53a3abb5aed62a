"""Makes lamps.glb and lamps.npz: a market street at nightfall, lit by 20,000 small lamps and nothing else.

Garlands of bulbs and paper lanterns hang between the houses, windows and shops are lit from within by rows of lamps,
candles stand along the gutters, stalls have lamps under their awnings. No sun and no emissive surface: a bulb or a
paper lantern is a small coloured body with its lamps just outside it. Run it from anywhere:
``python scenes/lamps/make.py [FOLDER]``.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from modelling import textures
from modelling.arches import arch_moulding, arched_wall
from modelling.glb import Finish, light_rows, write_glb
from modelling.houses import PLASTER, STONE, WOOD, awning, cornice, stall
from modelling.lamplight import PAPER, garland, lamps, lantern, lattice, light_list, without_lamps
from modelling.mesh import Model, Part, merge, moved, placed, repeatable, surface, turned
from modelling.plants import shrub
from modelling.run import run
from modelling.solids import ball, box, facets, lathe, panel
from modelling.town import house
from modelling.turned import pot

SEED, LAMPS = 1882, 20_000
HALF, NEAR, FAR = 3.9, 15.0, -21.0  # half the street's width, and its two ends along z
WIDTHS = (4.6, 5.6, 6.4)  # of the houses

WALLS = {
    "cream": (0.78, 0.66, 0.47),
    "ochre": (0.76, 0.50, 0.24),
    "brick": (0.66, 0.32, 0.22),
    "sage": (0.46, 0.52, 0.38),
    "blue": (0.36, 0.46, 0.56),
}
SHUTTERS = {"shutter_green": (0.35, 0.85, 0.5), "shutter_blue": (0.4, 0.75, 1.0), "shutter_red": (1.0, 0.5, 0.4)}
FRUIT = {"oranges": (0.75, 0.30, 0.04), "apples": (0.55, 0.05, 0.04), "limes": (0.25, 0.42, 0.06)}

POT = repeatable(pot(0.3, 0.5)[0])


def finishes(rng: np.random.Generator) -> dict[str, Finish]:
    """Every material, textures painted."""
    plaster, wood, stone = textures.plaster(rng), textures.wood(rng), textures.stone(rng)
    table = {
        "cobbles": Finish(texture=textures.cobbles(rng)),
        "stone": Finish((0.85, 0.88, 0.92), stone),
        "ashlar": Finish((0.9, 0.92, 0.95), textures.ashlar(rng)),
        "wood": Finish(texture=wood),
        "roof": Finish(texture=textures.roof(rng)),
        "stripes": Finish(texture=textures.stripes(rng)),
        "leaves": Finish(texture=textures.leaves(rng), masked=True),
        "clay": Finish((0.95, 0.45, 0.28), stone),
        "earth": Finish((0.06, 0.04, 0.025)),
        "iron": Finish((0.05, 0.05, 0.055)),
        "pane": Finish((0.86, 0.74, 0.52)),
        "dark_pane": Finish((0.035, 0.045, 0.06)),
        "wax": Finish((0.85, 0.78, 0.62)),
    }
    table |= {name: Finish(colour, plaster) for name, colour in WALLS.items()}
    table |= {name: Finish(colour, wood) for name, colour in SHUTTERS.items()}
    table |= {f"paper_{name}": Finish(colour) for name, colour in PAPER.items()}
    return table | {name: Finish(colour) for name, colour in FRUIT.items()}


def street(rng: np.random.Generator) -> Model:
    """The two rows of houses; fronts jut out or stand back a little, as in a town that grew."""
    model: Model = []
    names, paints = list(WALLS), list(SHUTTERS)
    for side in (-1, 1):
        z, k = NEAR + 2.0, 0 if side < 0 else 2
        while z - WIDTHS[0] > FAR:
            width = float(rng.choice([w for w in WIDTHS if z - w > FAR]))
            storeys = 2 + int(rng.uniform() < 0.62)
            back = rng.uniform(-0.25, 0.35)
            built = house(width, storeys, names[k % len(names)], paints[(k + (side > 0)) % len(paints)], rng)
            model += placed(built, side * (HALF + back), 0, z - width / 2, -90 * side)
            z -= width
            k += 1
    return model


def ground() -> Part:
    """The cobbled street, crowned, with a gutter on either side."""
    x = np.linspace(-HALF - 0.6, HALF + 0.6, 25)[None, :]
    z = np.linspace(NEAR + 3, FAR - 6, 81)[:, None]
    crown = 0.07 * (1 - (x / HALF) ** 2) - 0.05 * np.exp(-(((np.abs(x) - 2.9) / 0.16) ** 2))
    bumps = 0.012 * np.sin(2.1 * z + 1.3 * x) + 0.01 * np.sin(3.7 * x - 1.1 * z)
    y = np.maximum(crown, -0.08) + bumps - 0.02
    points = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    return surface(points, np.stack(np.broadcast_arrays(x / 2.0, z / 2.0), axis=-1), flip=True)


def gate() -> Model:
    """The town gate that closes the street: a tower with an archway, outlined in lamps."""
    z, width, height = FAR - 1.0, 9.6, 10.5
    frame = facets((0.3, 0), (0.3, 0.1), (0.0, 0.1), (0, 0))
    model: Model = [
        ("ashlar", moved(arched_wall(width, height, 2.0, 2.6, 2.2, 24, PLASTER), 0, 0, z)),
        ("stone", moved(arch_moulding(frame, 2.0, 2.6, 24, STONE, 2.6), 0, 0, z + 1.1)),
        ("stone", moved(cornice(width, 0), 0, 6.0, z + 1.1)),
        ("stone", moved(cornice(width, 0), 0, height - 0.3, z + 1.1)),
        ("stripes", panel(-1.0, 1.0, 6.9, 9.5, z + 1.16, 2.5)),
    ]
    for k in range(6):
        x = (k - 2.5) * 1.75
        model.append(("ashlar", box((x - 0.5, height, z - 1.1), (x + 0.5, height + 0.9, z + 1.1), PLASTER)))
    turn = np.linspace(0.02, np.pi - 0.02, 120)
    for radius, glow in ((2.45, "amber"), (2.65, "rose")):
        arch = np.stack([radius * np.cos(turn), 2.6 + radius * np.sin(turn), np.full_like(turn, z + 1.24)], axis=1)
        jamb = np.stack([np.full(60, radius), np.linspace(0.15, 2.55, 60), np.full(60, z + 1.24)], axis=1)
        model.append(lamps(glow, 0.06, np.concatenate([arch, jamb, jamb * [-1, 1, 1]])))
    inside = np.stack([1.85 * np.cos(turn), 2.6 + 1.85 * np.sin(turn), 0 * turn], axis=1)
    model += [lamps("teal", 0.08, inside[::2] + np.array([0, 0, z + dz])) for dz in (-0.7, 0.0, 0.7)]
    return model


def market(rng: np.random.Generator) -> Model:
    """Stalls with fruit under lamps, shrubs in pots, candles along the gutters."""
    model: Model = []
    bushes = [repeatable(shrub(1.1, 0.45, 60, rng)) for _ in range(3)]
    fruit = ball(0.058, 4, 6)
    places = [(dx, n) for dx in (-0.125, 0, 0.125) for n in range(5)]
    heap = repeatable(
        merge([moved(fruit, dx + rng.uniform(-0.01, 0.01), 0.03 * (dx == 0), 0.125 * n) for dx, n in places])
    )
    for side, z in ((-1, 9.0), (1, 6.2), (-1, 3.4), (1, -0.6), (-1, -3.6), (1, -7.2), (-1, -10.4), (1, -13.6)):
        wide, deep = 2.2, 0.95
        wood, top = stall(wide, deep)
        dye = int(rng.integers(0, 4))
        cover = moved(awning(wide + 0.4, deep + 0.45, dye, rng), 0, 2.42, -0.12)
        parts: Model = [("wood", wood), ("wood", top), ("stripes", cover)]
        for k in range(5):
            x = (k - 2) * 0.43
            parts.append(("wood", box((x - 0.19, 0.9, 0.2), (x + 0.19, 1.0, 0.85), WOOD, skip="-y")))
            parts.append((str(rng.choice(list(FRUIT))), moved(heap, x, 1.045, 0.28)))
        xs = np.linspace(-wide / 2, wide / 2, 25)
        for zz, y in ((0.25, 2.05), (0.6, 1.96), (0.95, 1.86)):
            parts.append(lamps("amber", 0.07, lattice(xs, np.array([y]), zz)))
        front = np.stack([xs, np.full(25, 1.7), np.full(25, deep + 0.42)], axis=1)
        parts.append(lamps("orange" if dye < 2 else "rose", 0.05, front))
        model += placed(parts, side * (HALF - 0.75), 0.05, z, -90 * side)
    for side in (-1, 1):
        for z in np.arange(NEAR - 3, FAR + 2, -4.3) + 0.7 * side:
            vessel, earth = POT, pot(0.3, 0.5)[1]
            bush = moved(turned(bushes[int(rng.integers(0, 3))], rng.uniform(0, 360)), 0, 0.14)
            plant: Model = [("clay", vessel), ("earth", earth), ("leaves", bush)]
            model += placed(plant, side * (HALF - 0.6), 0.02, z)
        row = np.arange(NEAR - 1.5, FAR + 1.5, -0.24)
        wax = lathe([np.array([(0.028, 0.0), (0.028, 0.07), (0.001, 0.07)])], 5)
        model.append(("wax", moved(merge([moved(wax, 0, 0, z) for z in row]), side * 2.62, -0.005)))
        flames = np.stack([np.full_like(row, side * 2.62), np.full_like(row, 0.15), row], axis=1)
        model.append(lamps("candle", 0.035, flames))
    return model


def overhead(rng: np.random.Generator) -> Model:
    """Garlands from side to side, each of one colour or of all, and paper lanterns under every second one."""
    model: Model = []
    glows = (None, "amber", "teal", "orange", None, "rose", "violet", "amber", "teal", "rose")
    for k, z in enumerate(np.arange(NEAR - 2.5, FAR + 1.2, -0.95)):
        height, slant = 5.2 + 0.2 * np.sin(0.9 * k) + rng.uniform(-0.08, 0.08), rng.uniform(-0.28, 0.28, 2)
        a = np.array([0.5 - HALF, height + rng.uniform(-0.1, 0.1), z + slant[0]])
        b = np.array([HALF - 0.5, height + rng.uniform(-0.1, 0.1), z + slant[1]])
        sag = rng.uniform(0.4, 0.65)
        model += garland(a, b, sag, glows[k % len(glows)], rng)
        if k % 2 == 0:
            for s in np.linspace(0.1, 0.9, 7) + rng.uniform(-0.03, 0.03, 7):
                place = a + (b - a) * s - np.array([0, 4 * sag * s * (1 - s), 0.035])  # clear of the lamps
                glow = str(rng.choice(list(PAPER), p=[0.26, 0.2, 0.18, 0.2, 0.16]))
                model += placed(lantern(glow, rng.uniform(0.15, 0.24), 0.17, 0.36, rng), *place)
    return model


def festoons(count: int) -> Model:
    """The last `count` lamps: fairy lights looped along both fronts, under the windows and under the eaves."""
    lines = [(side, y, glow) for side in (-1, 1) for y, glow in ((3.25, "amber"), (5.88, "orange"))]
    model: Model = []
    for k, (side, y, glow) in enumerate(lines):
        mine = count // len(lines) + (k < count % len(lines))
        z = np.linspace(NEAR - 0.5, FAR + 0.3, mine)
        loop = (z / 1.7) % 1.0
        droop = y - 0.9 * loop * (1 - loop)
        model.append(lamps(glow, 0.006, np.stack([np.full(mine, side * (HALF - 0.6)), droop, z], axis=1)))
    return model


def make(folder: Path) -> str:
    """Writes lamps.glb and lamps.npz into `folder`."""
    rng = np.random.default_rng(SEED)
    materials = finishes(rng)
    model = [("cobbles", ground()), *street(rng), *gate(), *market(rng), *overhead(rng)]
    missing = LAMPS - sum(len(part.position) for name, part in model if name.startswith("lamp "))
    if missing < 0:
        raise ValueError(f"{-missing} lamps too many: hang fewer garlands or lanterns")
    model += festoons(missing)
    position, intensity = light_list(model, rng)
    np.savez(folder / "lamps.npz", position=light_rows(position), intensity=light_rows(intensity))
    triangles = write_glb(folder / "lamps.glb", without_lamps(model), materials)
    return f"lamps.glb: {triangles} triangles; lamps.npz: {len(position)} lamps, {missing} of them in festoons"


if __name__ == "__main__":
    run(make, __file__)
