"""The sum over all lights in float64 numpy: every light at every pixel, each with its own shadow ray."""

from __future__ import annotations

import numpy as np

from .pure import falloff


def brute_force(engine, gbuffer, lights, params, shadows=True):
    """Irradiance (H, W, 3) of every light of `lights` at every pixel; float64 but for the rays of `engine`.

    Of `params` only falloff and clamp_distance count. Background pixels are 0.
    """
    clamp = params.clamp_distance * engine.scene_radius
    position, flux = lights.position.astype(np.float64), lights.flux.astype(np.float64)
    emitter = lights.normal.astype(np.float64)
    isotropic = ~emitter.any(axis=1)
    result = np.zeros((*gbuffer.depth.shape, 3))
    for y, x in np.argwhere(gbuffer.depth > 0):
        to_light = position - gbuffer.position[y, x].astype(np.float64)
        d2 = np.maximum((to_light**2).sum(axis=1), np.finfo(np.float64).tiny)
        toward = to_light / np.sqrt(d2)[:, None]
        cosine = np.maximum(0.0, toward @ gbuffer.normal[y, x].astype(np.float64))
        emission = np.where(isotropic, 0.25, np.maximum(0.0, -(toward * emitter).sum(axis=1)))
        weight = cosine * emission * falloff(d2, params.falloff, clamp) / np.pi
        lit = np.flatnonzero(weight > 0)
        if shadows and lit.size:
            lit = lit[engine.visible(gbuffer, int(y), int(x), lights.position[lit])]
        result[y, x] = weight[lit] @ flux[lit]
    return result
