"""The lighting grid hierarchy in float64, written from the paper (LY19 3.1) and its definitions alone.

Grids are sparse: a level is the list of its vertices that any light touches, with the raw sums of each.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from .pure import luminance

STEP = 2.0**-32  # of S1's fixed-point sums, relative to the flux scale
FLOAT = 2.0**-24  # rounding of a float32


@dataclass
class Source:
    """Lights that a level is built from.

    `weight`: trilinear weight in each; `variance`: of position inside each; `error`: bound of what each is off by.
    """

    position: np.ndarray
    flux: np.ndarray
    normal: np.ndarray
    normal_moment: np.ndarray
    oriented: np.ndarray
    weight: np.ndarray
    variance: np.ndarray
    error: np.ndarray
    vertex: np.ndarray | None = None  # S1: the vertex of each


@dataclass
class Level:
    """Vertices (v, 3) in grid order, x fastest, and what each holds.

    `error` bounds what float32 coordinates and fixed-point sums may make of its means, in cells; `flux_error` likewise.
    """

    vertex: np.ndarray
    position: np.ndarray
    flux: np.ndarray
    normal: np.ndarray
    normal_moment: np.ndarray
    variance: np.ndarray
    weight: np.ndarray
    oriented: np.ndarray
    error: np.ndarray
    flux_error: np.ndarray


def input_source(lights) -> Source:
    """S0 as a source: one normal each; a light without one has n = 0 and n n^T = I / 3."""
    n = lights.normal.astype(np.float64)
    oriented = np.any(n != 0, axis=1)
    outer = n[:, [0, 1, 2, 0, 0, 1]] * n[:, [0, 1, 2, 1, 2, 2]]
    moment = np.where(oriented[:, None], outer, np.array([1, 1, 1, 0, 0, 0]) / 3)
    position = lights.position.astype(np.float64)
    ones, zeros = np.ones(len(position)), np.zeros(len(position))
    return Source(position, lights.flux.astype(np.float64), n, moment, oriented, ones, np.zeros_like(position), zeros)


def level_source(level: Level, flux_scale: float, carry: bool) -> Source:
    """S1 as the source of a gather: its own lights, with their inner spread and weight when `carry`."""
    weight = level.weight if carry else np.ones(len(level.weight))
    variance = level.variance if carry else np.zeros_like(level.variance)
    kept = keep(level, flux_scale)
    return Source(
        level.position[kept], level.flux[kept], level.normal[kept], level.normal_moment[kept], level.oriented[kept],
        weight[kept], variance[kept], level.error[kept], level.vertex[kept],
    )  # fmt: skip


def flux_scale(flux) -> float:
    """The power of two above the largest flux; 1 for black lights."""
    largest = float(np.max(flux))
    return 2.0 ** (np.floor(np.log2(largest)) + 1) if largest > 0 else 1.0


def trilinear(u, cells):
    """Corner by corner, what lights at grid coordinates u (n, 3) give: yields vertex (n, 3) and weight (n,)."""
    inside = np.clip(u, 0, cells)
    cell = np.minimum(np.floor(inside), cells - 1)  # the far face belongs to the last cell
    for corner in product((0, 1), repeat=3):
        vertex = cell + np.array(corner)
        yield vertex.astype(np.int64), np.prod(1 - np.abs(inside - vertex), axis=1)


def build(source: Source, origin, cell_size, cells, *, centre_weight="flux", half_open=0, scale=1.0) -> Level:
    """One level of `cells`^3 cells from `source`. `half_open`: this level's stride in S1's vertices, 0: inclusive."""
    u = (source.position - origin) / cell_size
    owner, light, share = [], [], []
    for vertex, weight in trilinear(u, cells):
        found = weight > 0
        if half_open:  # the S1 vertices searched around v: from (v - 1) stride up to, not with, (v + 1) stride
            found &= np.all(source.vertex < (vertex + 1) * half_open, axis=1)
        owner.append(vertex[found])
        light.append(np.flatnonzero(found))
        share.append(weight[found])
    owner, light, share = np.concatenate(owner), np.concatenate(light), np.concatenate(share)
    keys, row = np.unique((owner[:, 2] * (cells + 1) + owner[:, 1]) * (cells + 1) + owner[:, 0], return_inverse=True)
    vertex = np.stack([keys % (cells + 1), keys // (cells + 1) % (cells + 1), keys // (cells + 1) ** 2], axis=1)

    def summed(values):
        total = np.zeros((len(keys), *values.shape[1:]))
        np.add.at(total, row, values)
        return total

    own = share * source.weight[light]
    lum = share * luminance(source.flux[light] / scale)
    counts = summed(own)
    by_flux = summed(np.rint(lum / STEP))[row] > 0 if centre_weight == "flux" else np.zeros(len(row), bool)
    moment_weight = np.where(by_flux, lum, own)
    total = summed(moment_weight)

    def mean(values):
        return summed(moment_weight[:, None] * values) / total[:, None]

    offset = u[light] - owner
    centre = mean(offset)
    inner = source.variance[light] / cell_size**2
    variance = np.maximum(0, mean((offset - centre[row]) ** 2 + inner)) * cell_size**2
    lit = np.any(source.flux[light] > 0, axis=1)
    stored = FLOAT * (np.abs(source.position).max() + abs(origin).max()) / cell_size  # of a position kept as float32
    rounding = 2 * FLOAT * cells + (stored if source.vertex is not None else 0) + source.error[light]
    touching = np.where(by_flux, luminance(source.flux[light] / scale), source.weight[light])
    steps = summed(np.ones(len(row))) * (STEP if source.vertex is None else 0)
    return Level(
        vertex=vertex,
        position=origin + (vertex + centre) * cell_size,
        flux=summed(share[:, None] * source.flux[light]),
        normal=mean(source.normal[light]),
        normal_moment=mean(source.normal_moment[light]),
        variance=variance,
        weight=counts,
        oriented=summed((source.oriented[light] & lit).astype(float)) > 0,
        error=1e-6 + stored + (2 * summed(touching * rounding) + steps) / total,
        flux_error=summed(source.flux[light] * (1e-6 + 3 * rounding)[:, None]) + (steps * scale)[:, None],
    )


def keep(level: Level, scale: float):
    """Which vertices hold any flux that the fixed-point sums can see."""
    return np.any(level.flux > scale * STEP, axis=1)


def all_levels(lights, hierarchy, params) -> list[Level]:
    """Levels 1..top over the grids of `hierarchy` (origin and cell sizes alone are taken from it)."""
    s0, top = input_source(lights), len(hierarchy.cell_size) - 1
    origin, scale = hierarchy.origin.astype(np.float64), flux_scale(lights.flux)
    settings = {"centre_weight": params.centre_weight, "scale": scale}
    levels = [build(s0, origin, float(hierarchy.cell_size[1]), 2 ** (top - 1), **settings)]
    for level in range(2, top + 1):
        size, cells = float(hierarchy.cell_size[level]), 2 ** (top - level)
        if params.construction == "scatter":
            levels.append(build(s0, origin, size, cells, **settings))
            continue
        s1 = level_source(levels[0], scale, params.carry_moments)
        half_open = 2 ** (level - 1) if params.gather_range == "half_open" else 0
        levels.append(build(s1, origin, size, cells, half_open=half_open, **settings))
    return levels


def count_s1(lights, origin, top_size, levels) -> int:
    """|S1| of a hierarchy of `levels` levels."""
    scale = flux_scale(lights.flux)
    cells = 2 ** (levels - 1)
    s1 = build(input_source(lights), origin.astype(np.float64), float(top_size) / cells, cells, scale=scale)
    return int(keep(s1, scale).sum())
