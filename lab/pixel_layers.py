"""Maps of a frame that no record holds as such: how noisy, from which level, how likely, from which tile."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance
from lab.engine.engine import Engine
from lab.errors import LabError
from lab.records import FilteredShadows, Floats, Frame, Hierarchy, Lighting, ShadowSamples


def ratio_of(shadows: ShadowSamples | FilteredShadows) -> Floats:
    """(H, W) S / U, before the filter or after; the luminance of an RGB ratio. NaN where nothing was picked."""
    known = shadows.weight > 0
    ratio = np.full(shadows.shadowed.shape, np.nan, np.float32)
    np.divide(shadows.shadowed, shadows.weight, out=ratio, where=known)
    return np.asarray(luminance(ratio), np.float32)


def picked_level(hierarchy: Hierarchy, lighting: Lighting) -> NDArray[np.int32]:
    """(H, W, k) level of each pick's grid light, -1 for none."""
    return np.asarray(np.searchsorted(hierarchy.offset[:-1], lighting.light, side="right") - 1, np.int32)


def pick_probability(lighting: Lighting) -> Floats:
    """(H, W, k) p = f / F of each pick, NaN for none."""
    total = np.broadcast_to(lighting.weight_sum[..., None], lighting.target_weight.shape)
    chosen = (lighting.light >= 0) & (total > 0)
    p = np.full(lighting.target_weight.shape, np.nan, np.float32)
    np.divide(lighting.target_weight, total, out=p, where=chosen)
    return p


def interleave_tile(size: tuple[int, int], n: int) -> NDArray[np.int32]:
    """(H, W) number of each pixel's tile, (y mod n) n + x mod n (LY19 4.3); `size` = (width, height)."""
    y, x = np.mgrid[: size[1], : size[0]]
    return np.asarray((y % n) * n + x % n, np.int32)


def level_irradiance(engine: Engine, frame: Frame, level: int) -> Floats:
    """(H, W, 3) unshadowed irradiance that the lights of one level give: those of all levels sum to the frame's.

    Made by stage `light` itself, with the flux of all other levels taken away. With interleaving it is, as
    ``frame.lighting.irradiance``, that of each pixel's own tile.
    """
    hierarchy = frame.hierarchy
    if not 0 <= level <= hierarchy.top:
        raise LabError(f"level {level}: this frame's hierarchy has the levels 0 to {hierarchy.top}")
    flux = np.zeros_like(hierarchy.flux)
    rows = slice(int(hierarchy.offset[level]), int(hierarchy.offset[level + 1]))
    flux[rows] = hierarchy.flux[rows]
    alone = dataclasses.replace(hierarchy, flux=flux)
    params = frame.params.replace(shadow_samples=0)
    return engine.light(alone, frame.gbuffer, params, counts=False).irradiance
