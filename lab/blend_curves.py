"""The blend weights of all levels over distance (LY19 2.2, Figure 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from lab.params import Params
from lab.records import Floats, Hierarchy


def blend_radii(hierarchy: Hierarchy, params: Params) -> Floats:
    """(L,) r_l = alpha h_l of every level."""
    return np.asarray(params.alpha * hierarchy.cell_size.astype(np.float64), np.float32)


def drawn_levels(hierarchy: Hierarchy, params: Params) -> range:
    """The levels that light is gathered from: `first_level`, or the top where that is finer still, and up."""
    return range(min(params.first_level, hierarchy.top), hierarchy.top + 1)


def blend_weights(hierarchy: Hierarchy, params: Params, distance: ArrayLike) -> Floats:
    """(L, n) B_l at `distance` (n,), by the core's own formula: it sums to 1 over levels; 0 for one not drawn."""
    from lab import _core

    d = np.ascontiguousarray(distance, np.float32).ravel()
    weights = np.zeros((hierarchy.top + 1, len(d)), np.float32)
    levels = drawn_levels(hierarchy, params)
    for level, radius in enumerate(blend_radii(hierarchy, params)):
        if level in levels:
            weights[level] = _core.blend_weight(d, float(radius), level == levels[0], level == levels[-1])
    return weights
