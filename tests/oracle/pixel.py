"""A pixel's grid lights in float64, by the definitions alone (LY19 3.2, 3.3): every term of every light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .lighting import softened
from .pure import blend_weight, emission, falloff, luminance


@dataclass
class Table:
    """(m,) terms of every light of the merged buffer; `inside`: whether its cube of half-edge 2 r holds the point."""

    distance: np.ndarray
    blend: np.ndarray
    cosine: np.ndarray
    emission: np.ndarray
    falloff: np.ndarray
    scale: np.ndarray
    contribution: np.ndarray
    target: np.ndarray
    probability: np.ndarray
    inside: np.ndarray

    @property
    def bright(self) -> np.ndarray:
        """(m,) luminance of each contribution."""
        return luminance(self.contribution)


def scales(hierarchy, params, tile, dealt_tile) -> np.ndarray:
    """(m,) what each light counts for in `tile`; `dealt_tile(count, level, n)` says where lights are dealt to."""
    n, parts = params.interleave, []
    for level, count in enumerate(np.diff(hierarchy.offset)):
        dealt = n > 1 and (params.deal_all or count >= n * n)
        share = np.where(dealt_tile(int(count), level, n) == tile, n * n, 0) if dealt else np.ones(count)
        parts.append(share * (level >= params.first_level))
    return np.concatenate(parts).astype(np.float64)


def table(hierarchy, position, normal, params, radius, scale) -> Table:
    """The lights as a point sees them; `scale`: (m,) what each counts for."""
    h, top = hierarchy, len(hierarchy.cell_size) - 1
    level = np.repeat(np.arange(top + 1), np.diff(h.offset))
    reach = params.alpha * h.cell_size.astype(np.float64)
    to = h.position.astype(np.float64) - np.asarray(position, np.float64)
    distance = np.linalg.norm(to, axis=1)
    w, n = to / distance[:, None], np.asarray(normal, np.float64)
    cosine = np.maximum(0, w @ n)
    if params.receiver == "soft":
        spread = np.linalg.norm(n * h.deviation, axis=1) / distance
        cosine = np.where(distance > reach[level] / 2, softened(w @ n, spread), cosine)
    blend, emitted = np.zeros(len(to)), np.zeros(len(to))
    for drawn in range(params.first_level, top + 1):
        rows = level == drawn
        blend[rows] = blend_weight(distance[rows], reach[drawn], drawn == params.first_level, drawn == top)
        lobe = "mean" if drawn == 0 else params.lobe  # one normal: every lobe is the plain cosine
        lit = h.oriented[rows] > 0
        emitted[rows] = emission(-w[rows], lobe, h.normal[rows], h.normal_moment[rows], lit)
    geometry = falloff(distance**2, params.falloff, params.clamp_distance * radius)
    contribution = (blend * cosine * emitted * geometry * scale / np.pi)[:, None] * h.flux.astype(np.float64)
    f = luminance(contribution) if params.importance else (luminance(contribution) > 0).astype(np.float64)
    chosen = np.where(level >= min(params.first_shadow_level, top), f, 0)
    chosen = chosen if chosen.sum() > 0 else f
    p = chosen / max(chosen.sum(), 1e-300)
    inside = ((np.abs(to).max(axis=1) <= 2 * reach[level]) | (level == top)) & (scale > 0)
    return Table(distance, blend, cosine, emitted, geometry, scale, contribution, f, p, inside)
