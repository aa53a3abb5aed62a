"""Houses of a market street, furnished and lit: doors, shops with shelves of jars, windows with shutters.

A house is made in its own frame: x along the street, its front in z = 0, the street on +z.
"""

from __future__ import annotations

import numpy as np

from modelling.houses import (
    PLASTER,
    STONE,
    WOOD,
    Opening,
    awning,
    casement,
    cornice,
    gable_roof,
    pierced_wall,
    shutter,
    trim,
    window_box,
)
from modelling.lamplight import lamps, lantern, lattice
from modelling.mesh import Model, Part, merge, mirrored, moved, placed, repeatable, scaled, turned, uv_moved
from modelling.plants import creeper
from modelling.solids import box, lathe, panel, quad, tube

STOREYS = (3.3, 2.9, 2.8)
WINDOW = (0.92, 1.55)
WARM = ("amber", "orange", "rose")
JARS = ("clay", "paper_teal", "paper_amber", "apples", "limes")

JAR = repeatable(lathe([np.array([(0.3, 0), (0.36, 0.5), (0.2, 0.75), (0.22, 1.0), (0.001, 1.0)])], 8))
ARM = repeatable(tube([(0, 0, 0), (0, 0.12, 0.35), (0, 0.04, 0.62)], 0.015, 4))
CASEMENT = repeatable(casement(*WINDOW))
SILL = repeatable(trim(Opening(-WINDOW[0] / 2, WINDOW[0] / 2, 0, WINDOW[1])))
RIGHT_SHUTTER = repeatable(shutter(WINDOW[0] / 2, WINDOW[1]))
LEFT_SHUTTER = repeatable(mirrored(shutter(WINDOW[0] / 2, WINDOW[1])))


def layout(width: float, storeys: int, rng: np.random.Generator) -> list[tuple[Opening, str]]:
    """The openings of a front and what each is: one `door`, `shop`s beside it, `window`s above."""
    columns = max(2, round(width / 1.9))
    pitch = width / columns
    middles = [(k - (columns - 1) / 2) * pitch for k in range(columns)]
    door = int(rng.integers(0, columns))
    kinds: list[tuple[Opening, str]] = []
    for k, x in enumerate(middles):
        if k == door:
            kinds.append((Opening(x - 0.52, x + 0.52, 0.02, 2.3, 0.3), "door"))
        else:
            kinds.append((Opening(x - 0.5 * pitch + 0.2, x + 0.5 * pitch - 0.2, 0.55, 2.6, 0.95), "shop"))
    for storey in range(1, storeys):
        low = sum(STOREYS[:storey]) + 0.75
        kinds += [(Opening(x - WINDOW[0] / 2, x + WINDOW[0] / 2, low, low + WINDOW[1]), "window") for x in middles]
    return kinds


def door(o: Opening, rng: np.random.Generator) -> Model:
    """A plank door, its step, a lamp on either side."""
    leaf = panel(o.left, o.right, o.low, o.high, -o.depth, WOOD)
    return [
        ("wood", uv_moved(leaf, *rng.uniform(0, 1, 2))),
        ("stone", trim(o)),
        ("stone", box((o.left - 0.2, 0, -0.2), (o.right + 0.2, 0.1, 0.35), STONE)),
        lamps("amber", 0.12, np.array([(o.left - 0.25, 2.35, 0.22), (o.right + 0.25, 2.35, 0.22)])),
    ]


def shop(o: Opening, rng: np.random.Generator) -> Model:
    """A shop behind a wide opening: shelves with jars, lamps under its ceiling and its shelves, often an awning."""
    model: Model = [("stone", trim(o))]
    for y in (0.95, 1.55, 2.1):
        model.append(("wood", box((o.left, y, -o.depth), (o.right, y + 0.04, -o.depth + 0.35), WOOD)))
        for x in np.arange(o.left + 0.2, o.right - 0.15, 0.3):
            jar = scaled(JAR, rng.uniform(0.16, 0.32))
            model.append((str(rng.choice(JARS)), moved(jar, x, y + 0.04, -o.depth + 0.17)))
    xs = np.linspace(o.left + 0.1, o.right - 0.1, 30)
    model += [lamps("amber", 0.05, lattice(xs, np.array([o.high - 0.09]), z)) for z in (-0.25, -0.5)]
    model += [lamps("candle", 0.03, lattice(xs, np.array([y - 0.07]), -o.depth + 0.42)) for y in (1.55, 2.1)]
    if rng.uniform() < 0.75:
        cover = awning(o.right - o.left + 0.3, 1.15, int(rng.integers(0, 4)), rng)
        model.append(("stripes", moved(cover, (o.left + o.right) / 2, 2.98, 0.02)))
    return model


def window(o: Opening, paint: str, rng: np.random.Generator) -> Model:
    """A window with shutters; most are lit by rows of lamps in their depth, some have a box of flowers."""
    x, lit = (o.left + o.right) / 2, rng.uniform() < 0.62
    model: Model = [
        ("pane" if lit else "dark_pane", panel(o.left, o.right, o.low, o.high, -o.depth, WOOD)),
        ("wood", moved(CASEMENT, x, o.low, 0.02 - o.depth)),
        ("stone", moved(SILL, x, o.low)),
    ]
    for leaf, sign in ((LEFT_SHUTTER, -1), (RIGHT_SHUTTER, 1)):
        swung = turned(leaf, -sign * rng.uniform(4, 28))
        model.append((paint, moved(swung, x + sign * (WINDOW[0] / 2 + 0.02), o.low, 0.03)))
    if lit:
        xs, ys = np.linspace(o.left + 0.13, o.right - 0.13, 7), np.linspace(o.low + 0.13, o.high - 0.13, 9)
        glow = str(rng.choice(["amber", "amber", "orange", "candle"]))
        model.append(lamps(glow, 0.03 * rng.uniform(0.5, 1.3), lattice(xs, ys, -o.depth + 0.13)))
    if rng.uniform() < 0.5:
        model.append(("wood", window_box(o)))
        model.append(("leaves", moved(creeper(0.5, 18, rng, 0.3), x, o.low + 0.25, 0.2)))
    return model


def plinth(kinds: list[tuple[Opening, str]], width: float) -> Part:
    """The stone foot of the wall, left out at the doors."""
    edges = [-width / 2]
    for o, kind in kinds:
        if kind == "door":
            edges += [o.left - 0.2, o.right + 0.2]
    edges.append(width / 2)
    return merge(
        [
            box((a, 0, -0.02), (b, 0.42, 0.06), STONE, skip="-z -y")
            for a, b in zip(edges[::2], edges[1::2], strict=True)
            if b > a
        ]
    )


def house(width: float, storeys: int, colour: str, paint: str, rng: np.random.Generator) -> Model:
    """A house with walls of finish `colour` and shutters of finish `paint`."""
    height, deep = sum(STOREYS[:storeys]) + 0.25, 5.0
    kinds = layout(width, storeys, rng)
    wall, reveals = pierced_wall(width, height, [o for o, _ in kinds])
    roof, gables = gable_roof(width, deep, height, 2.2)
    shift = rng.uniform(0, 1, 2)
    model: Model = [(colour, uv_moved(part, *shift)) for part in (wall, reveals, gables)]
    model += [("stone", cornice(width, height - 0.4)), ("roof", roof), ("ashlar", plinth(kinds, width))]
    for x in (-width / 2, width / 2):
        model.append((colour, quad((x, 0, 0), (x, 0, -deep), (x, height, -deep), (x, height, 0), PLASTER)))
    band = box((-width / 2, STOREYS[0] - 0.14, -0.02), (width / 2, STOREYS[0], 0.05), STONE, skip="-z")
    model.append(("stone", band))
    columns = sum(kind != "window" for _, kind in kinds)
    for k in range(1, columns):
        arm: Model = [("iron", ARM), *placed(lantern(str(rng.choice(WARM)), 0.14, 0.1, 0.2, rng), 0, 0.04, 0.62)]
        model += placed(arm, (k - columns / 2) * width / columns, 3.93)
    for o, kind in kinds:
        if kind == "door":
            model += door(o, rng)
        elif kind == "shop":
            model += [(colour, panel(o.left, o.right, o.low, o.high, -o.depth, PLASTER)), *shop(o, rng)]
        else:
            model += window(o, paint, rng)
    return model
