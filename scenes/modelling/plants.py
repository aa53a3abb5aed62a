"""Plants from leaf cards: curved strips that carry a twig texture with alpha."""

from __future__ import annotations

import numpy as np

from modelling.mesh import Part, merge, surface


def frond(length: float, width: float, droop: float, rng: np.random.Generator, steps: int = 3) -> Part:
    """A strip that starts at the origin, runs along +z rising a little, then bends down by `droop`."""
    t = np.linspace(0, 1, steps + 1)[:, None]
    side = np.array([-1.0, 0.0, 1.0])[None, :]
    z = length * t * (1 - 0.15 * t * droop) + 0 * side
    y = length * (0.9 * t - droop * t**2) - 0.18 * width * np.abs(side)
    x = 0.5 * width * side + rng.uniform(-0.1, 0.1) * length * t**2
    uv = np.stack(np.broadcast_arrays((side + 1) / 2, 1 - t), axis=-1)
    return surface(np.stack([x, y, z], axis=-1), uv)


def _aimed(part: Part, heading: float, tilt: float) -> Part:
    """`part` tilted up by `tilt`, then turned to `heading` (radians)."""
    ct, st, ch, sh = np.cos(tilt), np.sin(tilt), np.cos(heading), np.sin(heading)
    lift = np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]])
    turn = np.array([[ch, 0, sh], [0, 1, 0], [-sh, 0, ch]])
    matrix = turn @ lift
    return Part(part.position @ matrix.T, part.normal @ matrix.T, part.uv, part.index)


def shrub(height: float, radius: float, count: int, rng: np.random.Generator) -> Part:
    """A round bush of `count` twigs on an ellipsoid's surface and inside it, its foot at the origin."""
    golden = np.pi * (3 - np.sqrt(5))
    parts = []
    for k in range(count):
        up = 1 - 1.7 * (k + 0.5) / count
        heading = k * golden + rng.uniform(-0.3, 0.3)
        inside = rng.uniform(0.25, 0.75)
        ring = np.sqrt(max(0.0, 1 - up * up)) * inside
        foot = np.array(
            [ring * radius * np.sin(heading), height * (0.52 + 0.38 * up * inside), ring * radius * np.cos(heading)]
        )
        size = rng.uniform(0.75, 1.1) * radius
        twig = _aimed(frond(size, 0.62 * size, rng.uniform(0.3, 0.8), rng), heading, 0.7 * up + rng.uniform(-0.3, 0.3))
        parts.append(Part(twig.position + foot, twig.normal, twig.uv, twig.index))
    return merge(parts)


def creeper(length: float, count: int, rng: np.random.Generator, spread: float = 0.12) -> Part:
    """Leaves hanging down `length` from the origin along -y, facing +z: what grows over a balcony."""
    parts = []
    for k in range(count):
        t = (k + rng.uniform(0, 1)) / count
        size = rng.uniform(0.22, 0.36) * (1.15 - 0.5 * t)
        twig = _aimed(
            frond(size, 0.7 * size, rng.uniform(0.9, 1.5), rng, 2), rng.uniform(-1.1, 1.1), rng.uniform(-1.3, -0.3)
        )
        at = np.array([rng.normal() * spread * (1 - 0.6 * t), -t * length, rng.uniform(0, 0.06)])
        parts.append(Part(twig.position + at, twig.normal, twig.uv, twig.index))
    return merge(parts)
