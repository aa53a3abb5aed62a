"""Makes cornell.glb: the box everybody knows, with the proportions that were measured at Cornell, in metres.

Red wall on the left, green on the right, a tall and a short white block, one lamp in the ceiling that shines down.
Run it from anywhere: ``python scenes/cornell/make.py [FOLDER]``.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from modelling.glb import Finish, write_glb
from modelling.mesh import Part, moved, turned
from modelling.run import run
from modelling.solids import box, quad

WIDTH, HEIGHT, DEPTH = 5.56, 5.488, 5.592
LAMP = (1.30, 1.05)

FINISHES = {
    "white": Finish((0.73, 0.73, 0.70)),
    "red": Finish((0.61, 0.055, 0.06)),
    "green": Finish((0.115, 0.44, 0.10)),
    "lamp": Finish((0.78, 0.78, 0.78), emissive=(1.0, 0.74, 0.42), strength=17.0),
}


def block(size: tuple[float, float, float], degrees: float, x: float, z: float) -> Part:
    """A block of `size` standing on the floor, centred at (x, z), turned about its own axis."""
    w, h, d = size
    return moved(turned(box((-w / 2, 0, -d / 2), (w / 2, h, d / 2), skip="-y"), degrees), x, 0, z)


def model() -> list[tuple[str, Part]]:
    """The room: x from -WIDTH/2 to WIDTH/2, floor at y = 0, open toward +z."""
    x, y, z = WIDTH / 2, HEIGHT, DEPTH / 2
    a, b = LAMP[0] / 2, LAMP[1] / 2
    lamp_y = y - 0.005
    return [
        ("white", quad((-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z))),
        ("white", quad((-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z))),
        ("white", quad((-x, 0, -z), (x, 0, -z), (x, y, -z), (-x, y, -z))),
        ("red", quad((-x, 0, z), (-x, 0, -z), (-x, y, -z), (-x, y, z))),
        ("green", quad((x, 0, -z), (x, 0, z), (x, y, z), (x, y, -z))),
        ("white", block((1.65, 3.30, 1.65), 17.5, -0.94, -0.72)),
        ("white", block((1.65, 1.65, 1.65), -17.0, 0.92, 1.10)),
        ("lamp", quad((-a, lamp_y, -b), (a, lamp_y, -b), (a, lamp_y, b), (-a, lamp_y, b))),
    ]


def make(folder: Path) -> str:
    """Writes cornell.glb into `folder`."""
    return f"cornell.glb: {write_glb(folder / 'cornell.glb', model(), FINISHES)} triangles"


if __name__ == "__main__":
    run(make, __file__)
