"""Unshadowed light in float64: every grid light of a hierarchy at every point, by the definitions alone (LY19 3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from .pure import blend_weight, emission, falloff


@dataclass
class Lit:
    """Irradiance (p, 3); per level and point (L, p): exact counts, and the least and most that rounding may make."""

    irradiance: np.ndarray
    overdraw: np.ndarray
    overdraw_least: np.ndarray
    overdraw_most: np.ndarray
    used: np.ndarray
    used_least: np.ndarray
    used_most: np.ndarray


def softened(cosine, spread):
    """E[max(0, t)] of a Gaussian of mean `cosine` and standard deviation `spread`; the hard cosine where it is 0."""
    safe = np.where(spread > 0, spread, 1.0)
    z = cosine / safe
    value = cosine * (1 + erf(z / np.sqrt(2))) / 2 + safe * np.exp(-z * z / 2) / np.sqrt(2 * np.pi)
    return np.where(spread > 0, value, np.maximum(0, cosine))


def light(hierarchy, position, normal, params, scene_radius, tile=None) -> Lit:
    """Light at (p, 3) points. `tile(level, count)`: (count,) factor of each light of a level, 1 when left out."""
    x, nx = np.asarray(position, np.float64), np.asarray(normal, np.float64)
    levels = len(hierarchy.cell_size)
    total = np.zeros_like(x)
    counts = np.zeros((6, levels, len(x)))
    for level in range(params.first_level, levels):
        rows = slice(int(hierarchy.offset[level]), int(hierarchy.offset[level + 1]))
        factor = np.ones(rows.stop - rows.start) if tile is None else tile(level, rows.stop - rows.start)
        radius, top = params.alpha * float(hierarchy.cell_size[level]), level == levels - 1
        to_light = hierarchy.position[rows].astype(np.float64)[None] - x[:, None]
        distance = np.linalg.norm(to_light, axis=2)
        safe = np.where(distance > 0, distance, 1.0)
        direction = to_light / safe[..., None]  # a light in the very point has no direction, and cosine 0
        cosine = np.sum(direction * nx[:, None], axis=2)
        n, moment = hierarchy.normal[rows].astype(np.float64), hierarchy.normal_moment[rows].astype(np.float64)
        lobe = "mean" if level == 0 else params.lobe  # every lobe is the plain cosine for one normal
        emitted = emission(-direction, lobe, n, moment, hierarchy.oriented[rows] > 0)
        if params.receiver == "soft":
            spread = np.linalg.norm(nx[:, None] * hierarchy.deviation[rows][None].astype(np.float64), axis=2) / safe
            received = np.where(distance > radius / 2, softened(cosine, spread), np.maximum(0, cosine))
        else:
            received = np.maximum(0, cosine)
        ramps = radius, level == params.first_level, top
        blend = blend_weight(distance, *ramps)
        geometry = falloff(safe**2, params.falloff, params.clamp_distance * scene_radius)
        weight = blend * received * emitted * geometry * factor
        total += weight @ (hierarchy.flux[rows].astype(np.float64) / np.pi)

        reach = np.abs(to_light).max(axis=2)
        dealt = np.where(factor > 0, 1.0, 0.0)
        lit = dealt * np.any(hierarchy.flux[rows] > 0, axis=1)
        for i, slack in enumerate((0, -1e-6, 1e-6)):
            counts[i, level] = ((reach <= 2 * radius * (1 + slack)) | top) @ dealt
        soft = params.receiver == "soft"  # a Gaussian's tail ends where float32 does
        # Where all normals agree, what a coarse light sends backward is zero or a rounding error: may be counted.
        even = (lobe != "mean") & (moment[:, :3].sum(axis=1) - np.sum(n * n, axis=1) < 1e-3)
        near = np.maximum(blend_weight(distance * (1 - 1e-5), *ramps), blend_weight(distance * (1 + 1e-5), *ramps))
        counts[3, level] = ((blend > 0) & (received > 0) & (emitted > 0)) @ lit
        counts[4, level] = ((blend > 1e-5) & (received > 1e-5) & (emitted > np.where(even, 1e-2, 1e-5))) @ lit
        counts[5, level] = ((near > 0) & (soft | (cosine > -1e-5)) & ((emitted > 0) | even)) @ lit
    return Lit(total, *counts)


def exact_sum(lights, position, normal, params, scene_radius):
    """Irradiance at (p, 3) points from every input light: one-sided Lambertian, or isotropic without a normal."""
    x, nx = np.asarray(position, np.float64), np.asarray(normal, np.float64)
    to_light = lights.position.astype(np.float64)[None] - x[:, None]
    d2 = np.sum(to_light**2, axis=2)
    direction = to_light / np.sqrt(np.where(d2 > 0, d2, 1.0))[..., None]
    cosine = np.maximum(0, np.sum(direction * nx[:, None], axis=2))
    n = lights.normal.astype(np.float64)
    emitted = np.where(np.any(n != 0, axis=1), np.maximum(0, -np.sum(direction * n, axis=2)), 0.25)
    geometry = falloff(np.where(d2 > 0, d2, 1.0), params.falloff, params.clamp_distance * scene_radius)
    return (cosine * emitted * geometry) @ (lights.flux.astype(np.float64) / np.pi)
