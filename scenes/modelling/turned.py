"""Turned and carved stonework: columns with bases and capitals, balusters, a fountain, pots, hanging lanterns."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from modelling.mesh import Floats, Part, merge, moved, turned
from modelling.solids import ball, box, curve, lathe, ring

STONE = 2.0
"""Metres a repeat of the stone texture."""


def _bead(radius: float, y: float, size: float, steps: int = 4) -> Floats:
    """Half round moulding of height `size` that stands out from `radius`, bottom at `y`."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, steps + 1)
    return np.stack([radius + size / 2 * np.cos(turn), y + size / 2 * (1 + np.sin(turn))], axis=1)


def _hollow(low: float, high: float, y: float, size: float, steps: int = 4) -> Floats:
    """A scotia from radius `low` at `y` to `high` at `y` + `size`."""
    turn = np.linspace(0, np.pi, steps + 1)
    t = turn / np.pi
    return np.stack([low + (high - low) * t - 0.35 * size * np.sin(turn), y + size * t], axis=1)


def column(height: float, radius: float, segments: int = 18) -> Part:
    """A column with square plinth, attic base, swelling shaft, a capital of leaves and a square abacus on top."""
    r = radius
    plinth, abacus = 0.45 * r, 0.4 * r
    base, bell = 0.85 * r, 1.75 * r
    y0, y3 = plinth, height - abacus
    y1, y2 = y0 + base, height - abacus - bell
    attic = [
        _bead(1.16 * r, y0, 0.36 * r),
        _hollow(1.2 * r, 1.08 * r, y0 + 0.36 * r, 0.24 * r),
        _bead(1.06 * r, y0 + 0.6 * r, 0.25 * r),
    ]
    t = np.linspace(0, 1, 6)
    swell = r * (1.0 - 0.16 * t**1.8)
    neck = swell[-1]
    shaft = np.stack([swell, y1 + (y2 - y1) * t], axis=1)
    shaft = np.concatenate([[[1.07 * r, y1]], [[1.005 * r, y1 + 0.12 * r]], shaft[1:]])

    def leaves(angle: Floats, y: Floats) -> Floats:
        s = np.clip((y - y2 - 0.2 * r) / (bell - 0.2 * r), 0, 1)
        lower = np.sin(np.pi * np.clip(s / 0.55, 0, 1)) ** 1.5 * (0.5 + 0.5 * np.cos(8 * angle))
        upper = np.clip((s - 0.4) / 0.6, 0, 1) ** 1.6 * (0.5 + 0.5 * np.cos(8 * angle + np.pi)) * (s < 0.97)
        corner = np.clip((s - 0.6) / 0.4, 0, 1) * (0.5 - 0.5 * np.cos(4 * angle + np.pi))
        return 1 + 0.13 * lower + 0.1 * upper + 0.16 * corner

    s = np.linspace(0, 1, 9)
    flare = neck * (1.0 + 0.02 * s + 0.42 * s**3.2)
    capital = np.stack([flare, y2 + 0.2 * r + (bell - 0.2 * r) * s], axis=1)
    side, foot = 1.5 * r, 1.38 * r
    return merge(
        [
            box((-foot, 0, -foot), (foot, plinth, foot), STONE, skip="-y"),
            lathe([*attic, shaft, _bead(neck, y2, 0.2 * r, 3)], segments, STONE),
            lathe([capital], 24, STONE, leaves),
            box((-side, y3, -side), (side, y3 + 0.55 * abacus, side), STONE, skip="+y"),
            box((-1.08 * side, y3 + 0.55 * abacus, -1.08 * side), (1.08 * side, height, 1.08 * side), STONE, skip="+y"),
        ]
    )


def baluster(height: float, radius: float, segments: int = 6) -> Part:
    """A turned baluster."""
    profile = [(0.75, 0), (0.72, 0.1), (0.42, 0.15), (1.0, 0.36), (0.62, 0.62), (0.4, 0.82), (0.75, 0.92), (0.72, 1)]
    return lathe([np.asarray(profile) * np.array([radius, height])], segments, STONE)


def pot(radius: float, height: float) -> tuple[Part, Part]:
    """A planter with a rolled rim, and the earth in it."""
    r, h = radius, height
    outside = curve(
        [(0.55 * r, 0.0), (0.62 * r, 0.06 * h), (0.86 * r, 0.4 * h), (0.97 * r, 0.8 * h), (0.94 * r, 0.88 * h)], 10
    )
    foot = np.array([(0.7 * r, 0.0), (0.7 * r, 0.05 * h), (0.6 * r, 0.07 * h)])
    rim = np.concatenate([_bead(0.98 * r, 0.86 * h, 0.14 * h), [[0.88 * r, h], [0.86 * r, 0.84 * h]]])
    earth = lathe([np.array([(0.87 * r, 0.9 * h), (0.001, 0.93 * h)])], 20, 0.5)
    return lathe([foot, outside, rim], 18, 1.0), earth


def amphora(height: float) -> Part:
    """A clay jar with two handles."""
    h = height
    body = curve(
        [
            (0.10, 0),
            (0.13, 0.04),
            (0.24, 0.3),
            (0.27, 0.55),
            (0.2, 0.75),
            (0.09, 0.86),
            (0.085, 0.95),
            (0.13, 1.0),
            (0.1, 0.99),
        ],
        14,
    )
    handle = moved(turned(ring(0.085 * h, 0.018 * h, 8, 5), 0), 0.13 * h, 0.83 * h, 0)
    return merge([lathe([body * h], 14, 1.0), handle, turned(handle, 180)])


def fountain(radius: float) -> tuple[Part, Part]:
    """An eight-sided basin of `radius` with a bowl on a stem in its middle, and the water in both."""
    r = radius

    def eight(pieces: list[ArrayLike]) -> Part:
        wall = lathe(pieces, 8, STONE)
        corners = wall.position[wall.index]
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        return Part(
            corners.reshape(-1, 3), np.repeat(flat, 3, axis=0), wall.uv[wall.index].reshape(-1, 2),
            np.arange(3 * len(corners)).reshape(-1, 3),
        )  # fmt: skip

    basin = eight(
        [
            [(1.32 * r, 0), (1.32 * r, 0.15), (1.12 * r, 0.15)],
            [(1.03 * r, 0.15), (1.03 * r, 0.24), (0.97 * r, 0.29), (0.97 * r, 0.56), (1.0 * r, 0.6), (1.07 * r, 0.62)],
            [(1.07 * r, 0.62), (1.07 * r, 0.72), (0.85 * r, 0.72), (0.85 * r, 0.2)],
            [(1.12 * r, 0.15), (1.03 * r, 0.15)],
        ]
    )
    stem = curve([(0.3, 0.2), (0.3, 0.5), (0.17, 0.75), (0.13, 1.0), (0.2, 1.2), (0.14, 1.32), (0.12, 1.4)], 20)
    bowl = curve([(0.12, 1.4), (0.3, 1.45), (0.56, 1.58), (0.7, 1.78), (0.74, 1.8)], 12)
    lip = np.array([(0.74, 1.8), (0.75, 1.84), (0.7, 1.84), (0.62, 1.74)])
    finial = curve([(0.09, 1.7), (0.08, 1.9), (0.13, 2.0), (0.07, 2.12), (0.1, 2.22), (0.05, 2.33), (0.001, 2.38)], 20)

    def scallops(angle: Floats, y: Floats) -> Floats:
        return 1 + 0.035 * np.abs(np.cos(7 * angle)) * np.clip((y - 1.42) / 0.2, 0, 1) * (y < 1.79)

    stone = merge(
        [basin, lathe([stem, finial], 24, STONE), lathe([bowl], 56, STONE, scallops), lathe([lip], 56, STONE)]
    )
    water = merge([lathe([[(0.9 * r, 0.56), (0.001, 0.56)]], 8, 1.0), lathe([[(0.68, 1.79), (0.001, 1.79)]], 24, 1.0)])
    return turned(stone, 22.5), turned(water, 22.5)


def hanging_lantern(drop: float) -> Part:
    """A bronze lantern on a chain that hangs `drop` below the origin."""
    links = max(2, round((drop - 0.4) / 0.075))
    parts = []
    for k in range(links):
        link = ring(0.036, 0.008, 6, 3)
        link = Part(link.position * np.array([0.65, 1.25, 1]), link.normal, link.uv, link.index)
        parts.append(moved(turned(link, 90 * (k % 2)), 0, -0.03 - 0.075 * k, 0))
    top = -0.075 * links
    cap = np.array([(0.001, 0.0), (0.03, -0.01), (0.05, -0.05), (0.16, -0.11), (0.175, -0.15)])[::-1]
    pan = np.array([(0.001, -0.52), (0.03, -0.5), (0.04, -0.46), (0.13, -0.42), (0.135, -0.38)])
    parts.append(moved(lathe([cap, pan], 12, 1.0), 0, top, 0))
    parts.append(moved(ball(0.03, 4, 8), 0, top - 0.54, 0))
    for k in range(6):
        bar = box((0.13, -0.4, -0.008), (0.146, -0.13, 0.008), skip="-y +y")
        parts.append(moved(turned(bar, 60 * k), 0, top, 0))
    return merge(parts)
