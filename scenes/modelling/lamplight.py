"""Small lamps, and what carries them: lattices in windows, paper lanterns, garlands of bulbs.

A lamp is modelled as a part without triangles whose finish is the name of its light, "lamp GLOW INTENSITY"; it is moved
and turned with the house it belongs to, and :func:`light_list` collects all of them at the end.
"""

from __future__ import annotations

import numpy as np

from modelling.mesh import Floats, Model, Part, merge, moved, placed, repeatable, scaled
from modelling.solids import ball, lathe, tube

GLOWS: dict[str, tuple[float, float, float]] = {
    "amber": (1.0, 0.52, 0.16),
    "orange": (1.0, 0.34, 0.07),
    "rose": (1.0, 0.20, 0.22),
    "teal": (0.10, 0.72, 0.66),
    "violet": (0.48, 0.20, 0.95),
    "candle": (1.0, 0.45, 0.11),
}
"""Colours of the lamps; "lamp amber 0.2" is radiant intensity 0.2 times that colour."""

PAPER = {
    "amber": (0.88, 0.66, 0.32),
    "orange": (0.88, 0.42, 0.14),
    "rose": (0.86, 0.25, 0.24),
    "teal": (0.20, 0.72, 0.66),
    "violet": (0.50, 0.30, 0.82),
}
"""Reflectance of paper and bulbs of each glow; finish "paper_amber" and so on."""


def _paper(stretch: float) -> Part:
    """A paper lantern of radius 1 hung at the origin."""
    t = np.linspace(-0.43 * np.pi, 0.43 * np.pi, 7)
    return lathe([np.stack([np.cos(t), stretch * (np.sin(t) - 1)], axis=1)], 12)


SHADES = {"round": (repeatable(_paper(0.9)), 0.9, 1.0), "tall": (repeatable(_paper(1.5)), 1.5, 0.8)}
"""Paper lanterns of radius 1: shape, half height, how wide they are made."""

CAP = repeatable(lathe([np.array([(0.38, -0.12), (0.36, 0.08), (0.02, 0.12), (0.01, 0.45)])], 8))
PER_LANTERN = 20


def lamps(glow: str, intensity: float, position: Floats) -> tuple[str, Part]:
    """Lamps at `position` (n, 3)."""
    rows = np.asarray(position, dtype=np.float64).reshape(-1, 3)
    return f"lamp {glow} {intensity:g}", Part(
        rows, np.zeros_like(rows), np.zeros((len(rows), 2)), np.zeros((0, 3), int)
    )


def lattice(xs: Floats, ys: Floats, z: float) -> Floats:
    """Points of a lattice in the plane z."""
    x, y = np.meshgrid(xs, ys)
    return np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)


def lantern(glow: str, size: float, intensity: float, cord: float, rng: np.random.Generator) -> Model:
    """A paper lantern on a cord from the origin, with lamps all round it, 11 cm off the paper."""
    shape, stretch, width = SHADES[str(rng.choice(list(SHADES)))]
    radius = size * width
    number = np.arange(PER_LANTERN)
    turn, up = number * np.pi * (3 - np.sqrt(5)), 0.8 - 1.8 * (number + 0.5) / PER_LANTERN
    out = np.sqrt(1 - up**2)
    shell = np.stack([out * np.cos(turn), stretch * up, out * np.sin(turn)], axis=1) * (radius + 0.11)
    body: Model = [
        (f"paper_{glow}", scaled(shape, radius)),
        ("iron", scaled(CAP, radius)),
        lamps(glow, intensity, shell - np.array([0, stretch * radius, 0])),
    ]
    return [("iron", tube([(0, -cord, 0), (0, 0, 0)], 0.005, 3)), *placed(body, 0, -cord)]


def garland(a: Floats, b: Floats, sag: float, glow: str | None, rng: np.random.Generator, pitch: float = 0.09) -> Model:
    """A wire from `a` to `b` that sags, with a bulb every `pitch` metres and its lamp just under the bulb.

    Without a `glow` the bulbs are of all colours.
    """
    t = np.linspace(0, 1, 21)[:, None]
    up = np.array([0.0, 1.0, 0.0])
    wire = a + (b - a) * t - 4 * sag * t * (1 - t) * up
    count = max(2, int(np.linalg.norm(b - a) / pitch))
    s = ((np.arange(count) + 0.5) / count)[:, None]
    places = a + (b - a) * s - (4 * sag * s * (1 - s) + 0.06) * up
    share = [1.0 * (name == glow) for name in PAPER] if glow else [0.36, 0.2, 0.16, 0.16, 0.12]
    colours = rng.choice(list(PAPER), count, p=share)
    bulb = ball(0.034, 2, 4)
    model: Model = [("iron", tube(wire, 0.006, 3))]
    for colour in PAPER:
        mine = places[colours == colour]
        if len(mine):
            model.append((f"paper_{colour}", merge([moved(bulb, *p) for p in mine])))
            model.append(lamps(colour, 0.05, mine - 0.085 * up))
    return model


def light_list(model: Model, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Positions and radiant intensities (n, 3) of all lamps in `model`; no two lamps are quite alike."""
    position, intensity = [], []
    for name, part in model:
        if not name.startswith("lamp "):
            continue
        _, glow, strength = name.split()
        each = rng.uniform(0.75, 1.25, (len(part.position), 1))
        position.append(part.position)
        intensity.append(each * float(strength) * np.array(GLOWS[glow]))
    return np.concatenate(position), np.concatenate(intensity)


def without_lamps(model: Model) -> Model:
    """What of `model` has triangles."""
    return [row for row in model if not row[0].startswith("lamp ")]
