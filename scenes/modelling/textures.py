"""The textures, painted: stone, ashlar, paving, tiles, wood, plaster, cobbles, leaves and cloth.

Reflectances are linear and plausible: stone 0.3..0.6, wood 0.1..0.3, dyed cloth saturated.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from modelling.images import Texture, blend, cells, jpeg, noise, png, smooth_step, tint
from modelling.mesh import Floats

WARM = np.array([0.66, 0.56, 0.43])
GREY = np.array([0.46, 0.44, 0.41])
CLAY = np.array([0.50, 0.22, 0.12])


def _joint(distance: Floats, width: float) -> Floats:
    """1 in a joint, 0 on the stone; `distance` to the nearest edge, in the units of `width`."""
    return 1 - smooth_step(width * 0.5, width, distance)


def _stone(size: int, rng: np.random.Generator, colour: Floats) -> Floats:
    """Weathered stone: clouds, grain, pits and stains that run down."""
    cloud, grain = noise(size, rng, 1.3), noise(size, rng, 0.5, 24)
    stain = smooth_step(0.4, 2.2, noise(size, rng, 1.4, 2, stretch=0.16))
    warm = noise(size, rng, 1.5, 1)
    shade = 1 + 0.06 * cloud + 0.045 * grain
    base = tint(colour, shade) * (1 + 0.03 * warm[..., None] * np.array([1.0, 0.2, -1.2]))
    base = blend(base, base * np.array([0.62, 0.6, 0.58]), 0.7 * stain)
    pits = smooth_step(1.7, 2.6, noise(size, rng, 0.7, 40))
    return np.asarray(base * (1 - 0.3 * pits[..., None]))


def stone(rng: np.random.Generator) -> Texture:
    """Plain dressed stone for columns, mouldings and balusters; 2 m a repeat."""
    return jpeg("stone", _stone(512, rng, WARM), 82)


def ashlar(rng: np.random.Generator) -> Texture:
    """Eight courses of blocks, each of its own tint, with lime joints; 4 m a repeat."""
    size, courses, blocks = 1024, 8, 4
    u, v = cells(size)
    row = np.floor(v * courses).astype(int)
    shift = rng.uniform(0.3, 0.7, courses)[row] * (row % 2) + 0.05 * row
    x = u * blocks + shift
    column = np.floor(x).astype(int) % blocks
    number = row * blocks + column
    tone = rng.normal(1, 0.075, courses * blocks)[number]
    hue = rng.normal(0, 0.035, courses * blocks)[number]
    metre = 4.0
    edge_x = np.minimum(x % 1, 1 - x % 1) * metre / blocks
    edge_y = np.minimum((v * courses) % 1, 1 - (v * courses) % 1) * metre / courses
    worn = 0.006 * noise(size, rng, 0.9, 8)
    joint = _joint(np.minimum(edge_x, edge_y) + worn, 0.022)
    face = _stone(size, rng, WARM * 0.98) * tone[..., None] * (1 + hue[..., None] * np.array([1.0, 0.1, -1.0]))
    return jpeg(
        "ashlar",
        blend(face, np.array([0.33, 0.29, 0.23]) * (1 + 0.1 * noise(size, rng, 0.8, 16))[..., None], joint),
        78,
    )


def paving(rng: np.random.Generator) -> Texture:
    """The court's floor: pale octagons with small dark squares between them; 4 m a repeat, octagons 1 m."""
    size, count = 1024, 4
    u, v = cells(size)
    x, y = u * count % 1 - 0.5, v * count % 1 - 0.5
    near = np.minimum(0.5 - np.abs(x), 0.5 - np.abs(y))
    corner = (1 - np.abs(x) - np.abs(y)) / np.sqrt(2)  # distance to the octagon's slanted side is corner - side
    side = 0.2
    inset = smooth_step(-0.004, 0.004, side - corner)
    number = np.floor(u * count).astype(int) * count + np.floor(v * count).astype(int)
    sx, sy = np.floor(u * count + 0.5).astype(int) % count, np.floor(v * count + 0.5).astype(int) % count
    tone = rng.normal(1, 0.085, count * count)[number]
    dark_tone = rng.normal(1, 0.12, count * count)[sx * count + sy]
    pale = _stone(size, rng, np.array([0.60, 0.53, 0.43])) * tone[..., None]
    dark = _stone(size, rng, np.array([0.30, 0.15, 0.10])) * dark_tone[..., None]
    worn = 0.004 * noise(size, rng, 0.9, 8)
    edge = np.minimum(np.where(corner > side, near, 1.0), np.abs(corner - side)) + worn
    return jpeg("paving", blend(blend(pale, dark, inset), np.array([0.2, 0.17, 0.14]), _joint(edge, 0.016)), 78)


def tiles(rng: np.random.Generator) -> Texture:
    """Clay and cream tiles laid as a chequer, for the walks; 2.4 m a repeat, 6 tiles."""
    size, count = 512, 6
    u, v = cells(size)
    column, row = np.floor(u * count).astype(int), np.floor(v * count).astype(int)
    tone = rng.normal(1, 0.1, (count, count))[row, column]
    clay, cream = _stone(size, rng, CLAY * 0.9), _stone(size, rng, np.array([0.55, 0.47, 0.34]))
    face = np.where(((column + row) % 2 == 0)[..., None], clay, cream) * tone[..., None]
    x, y = u * count % 1, v * count % 1
    edge = np.minimum.reduce([x, 1 - x, y, 1 - y]) + 0.008 * noise(size, rng, 0.9, 8)
    return jpeg("tiles", blend(face, np.array([0.24, 0.2, 0.16]), _joint(edge, 0.04)), 80)


def wood(rng: np.random.Generator) -> Texture:
    """Dark oak planks along v; 1.6 m a repeat, 8 planks."""
    size, planks = 512, 8
    u, _ = cells(size)
    number = np.floor(u * planks).astype(int)
    tone = rng.normal(1, 0.16, planks)[number]
    phase = rng.uniform(0, 1, planks)[number]
    figure = np.sin(2 * np.pi * (9 * (u * planks % 1) + 1.1 * noise(size, rng, 1.6, 1, stretch=6) + 5 * phase))
    fibre = noise(size, rng, 0.6, 8, stretch=14)
    shade = tone * (1 + 0.12 * figure + 0.12 * fibre)
    x = u * planks % 1
    face = tint([0.24, 0.135, 0.07], np.clip(shade, 0.3, 1.8))
    return jpeg("wood", blend(face, np.array([0.03, 0.02, 0.012]), _joint(np.minimum(x, 1 - x), 0.05)), 80)


def roof(rng: np.random.Generator) -> Texture:
    """Rows of clay pantiles; 2 m a repeat, 8 x 6."""
    size, across, down = 512, 10, 6
    u, v = cells(size)
    row = np.floor(v * down).astype(int)
    x, y = u * across, v * down % 1
    tone = rng.normal(1, 0.15, (down, across))[row, np.floor(x).astype(int)]
    hump = 0.55 + 0.45 * np.abs(np.sin(np.pi * x))
    lip = 1 - 0.55 * smooth_step(0.86, 0.98, y)
    return jpeg("roof", _stone(size, rng, CLAY) * (tone * hump * lip)[..., None], 78)


def plaster(rng: np.random.Generator) -> Texture:
    """Lime wash, near white so that a base colour tints it; 4 m a repeat."""
    size = 1024
    face = _stone(size, rng, np.array([0.86, 0.85, 0.83]))
    bare = smooth_step(1.5, 1.75, noise(size, rng, 1.25, 2) + 0.12 * noise(size, rng, 0.6, 20))
    return jpeg("plaster", blend(face, _stone(size, rng, np.array([0.6, 0.5, 0.42])), 0.85 * bare), 74)


def cobbles(rng: np.random.Generator) -> Texture:
    """Rounded setts in offset rows; 2 m a repeat, 14 rows."""
    size, rows, per_row = 1024, 14, 10
    u, v = cells(size)
    bend = 0.05 * noise(size, rng, 2.0, 1)
    y = v * rows + 2 * bend
    row = np.floor(y).astype(int) % rows
    x = u * per_row + rng.uniform(0, 1, rows)[row] + bend
    number = row * per_row + np.floor(x).astype(int) % per_row
    tone = rng.normal(1, 0.17, rows * per_row)[number]
    hue = rng.normal(0, 0.05, rows * per_row)[number]
    ex, ey = np.abs(x % 1 - 0.5) * 2, np.abs(y % 1 - 0.5) * 2
    out = (ex**4 + ey**4) ** 0.25 + 0.05 * noise(size, rng, 1.0, 8)
    dome = 1 - 0.35 * smooth_step(0.3, 0.9, out)
    face = _stone(size, rng, GREY) * (tone * dome)[..., None] * (1 + hue[..., None] * np.array([1.0, 0.0, -1.0]))
    return jpeg("cobbles", blend(face, np.array([0.07, 0.06, 0.05]), smooth_step(0.84, 0.95, out)), 72)


def leaves(rng: np.random.Generator) -> Texture:
    """A twig with leaves on a clear ground, foot at the bottom; alpha is 0 or 255."""
    size, fine = 160, 6
    mask = Image.new("L", (size * fine, size * fine), 0)
    tone = Image.new("L", (size * fine, size * fine), 128)
    draw, paint = ImageDraw.Draw(mask), ImageDraw.Draw(tone)
    scale = size * fine

    def leaf(x: float, y: float, heading: float, length: float, shade: int) -> None:
        t = np.linspace(0, 1, 17)
        half = 0.24 * length * np.sin(np.pi * t**0.8) * (1 - 0.25 * t)
        ca, sa = np.cos(heading), np.sin(heading)
        along = np.concatenate([t, t[::-1]]) * length
        aside = np.concatenate([half, -half[::-1]])
        outline = [
            ((x + a * ca - b * sa) * scale, (y - a * sa - b * ca) * scale) for a, b in zip(along, aside, strict=True)
        ]
        draw.polygon(outline, fill=255)
        paint.polygon(outline, fill=shade)
        paint.line([outline[0], outline[16]], fill=min(255, shade + 50), width=fine * 2)

    draw.line([(0.5 * scale, scale), (0.5 * scale, 0.2 * scale)], fill=255, width=3 * fine)
    for k in range(7):
        y = 0.95 - 0.115 * k
        size_k = 0.34 * (1 - 0.06 * k)
        for side in (1, -1):
            heading = np.pi / 2 - side * rng.uniform(0.65, 1.05)
            leaf(0.5, y - 0.03 * (side > 0), heading, size_k * rng.uniform(0.85, 1.1), int(rng.integers(90, 165)))
    leaf(0.5, 0.24, np.pi / 2, 0.23, 150)
    alpha = np.asarray(mask.resize((size, size), Image.Resampling.BOX), dtype=np.float64) / 255
    shade = np.asarray(tone.resize((size, size), Image.Resampling.BOX), dtype=np.float64) / 128
    colour = np.clip(tint([62, 98, 38], shade), 0, 255)  # 8-bit sRGB: olive green under the transparent part too
    rgba = np.concatenate([np.round(colour), np.where(alpha > 0.5, 255.0, 0.0)[..., None]], axis=-1)
    return png("leaves", rgba.astype(np.uint8))


DYES = {
    "red": (0.28, 0.008, 0.008),
    "blue": (0.018, 0.06, 0.31),
    "green": (0.022, 0.15, 0.045),
    "ochre": (0.36, 0.135, 0.008),
}
"""The cloths of :func:`cloth`, left to right, a quarter of the texture each."""


def cloth(rng: np.random.Generator) -> Texture:
    """Four woven banners side by side (see :data:`DYES`), each with a border and an eight-pointed star."""
    size, count = 1024, len(DYES)
    u, v = cells(size)
    weave = 1 + 0.06 * noise(size, rng, 0.2, 60, stretch=4) + 0.06 * noise(size, rng, 0.2, 60, stretch=0.25)
    worn = 1 + 0.07 * noise(size, rng, 1.4, 2)
    gold, cream = np.array([0.50, 0.28, 0.05]), np.array([0.70, 0.62, 0.46])
    x, number = u * count % 1, np.floor(u * count).astype(int)
    face = np.array(list(DYES.values()))[number]
    aspect = 3.0  # a banner is this much longer than wide
    edge = np.minimum(np.minimum(x, 1 - x), np.minimum(v, 1 - v) * aspect)
    band = ((edge > 0.055) & (edge < 0.105)) | ((edge > 0.125) & (edge < 0.14))
    dx, dy = (x - 0.5), (v - 0.5) * aspect
    square = np.maximum(np.abs(dx), np.abs(dy))
    diamond = (np.abs(dx) + np.abs(dy)) / np.sqrt(2)
    star = np.minimum(square, diamond)
    emblem = ((star < 0.235) & (star > 0.205)) | (star < 0.15)
    hole = np.hypot(dx, dy) < 0.075
    trim = np.where((number == 3)[..., None], np.array([0.42, 0.03, 0.025]), gold)
    face = np.where((band | (emblem & ~hole))[..., None], trim, face)
    lozenge = (np.abs(dx) * 3 + np.abs(np.abs(dy) - 0.78) * 1.5) < 0.16
    face = np.where(lozenge[..., None], cream, face)
    return jpeg("cloth", face * (weave * worn)[..., None], 84)


AWNINGS = ((0.50, 0.03, 0.025), (0.03, 0.10, 0.34), (0.04, 0.22, 0.09), (0.60, 0.28, 0.03))
"""Dyes of the bands of :func:`stripes`, top to bottom."""


def stripes(rng: np.random.Generator) -> Texture:
    """Awning cloth: a quarter of the texture's height for each of :data:`AWNINGS`, striped with cream along u."""
    size = 512
    u, v = cells(size)
    dyed = smooth_step(-0.05, 0.05, np.sin(2 * np.pi * 3 * u))
    weave = 1 + 0.05 * noise(size, rng, 0.3, 20) + 0.06 * noise(size, rng, 1.2, 2)
    dye = np.array(AWNINGS)[np.floor(v * len(AWNINGS)).astype(int)]
    return jpeg("stripes", blend(np.broadcast_to([0.68, 0.62, 0.5], dye.shape), dye, dyed) * weave[..., None], 82)
