"""Reference images: every input light, every shadow ray, no hierarchy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import GBuffer, Lights


def brute_force(
    engine: CpuEngine,
    gbuffer: GBuffer,
    lights: Lights,
    params: Params,
    *,
    shadows: bool = True,
    progress: Callable[[float], None] | None = None,
) -> NDArray[np.float64]:
    """Irradiance from every light of `lights` at every pixel, in float64 but for the rays.

    Returns (H, W, 3); background pixels are 0. Of `params` only ``falloff`` and ``clamp_distance`` count.
    The time goes with pixels times lights: about a minute for 160x90 pixels and 20,000 lights.
    `progress` is called with the share of pixels done.
    """
    radius = engine.scene_radius
    clamp2 = (params.clamp_distance * radius) ** 2
    position, flux = lights.position.astype(np.float64), lights.flux.astype(np.float64)
    normals = np.zeros_like(lights.position) if lights.normal is None else lights.normal
    emitter = normals.astype(np.float64)
    isotropic = ~emitter.any(axis=1)
    result = np.zeros((*gbuffer.depth.shape, 3))
    pixels = np.argwhere(gbuffer.depth > 0)
    for done, (y, x) in enumerate(pixels):
        point, normal = gbuffer.position[y, x].astype(np.float64), gbuffer.normal[y, x].astype(np.float64)
        to_light = position - point
        d2 = np.einsum("ij,ij->i", to_light, to_light)
        distance = np.sqrt(np.maximum(d2, np.finfo(np.float64).tiny))
        cosine = np.maximum(0.0, to_light @ normal) / distance
        emission = np.maximum(0.0, -np.einsum("ij,ij->i", to_light, emitter)) / distance
        emission[isotropic] = 0.25
        softened = params.falloff == "softened"
        falloff = 1 / (d2 + clamp2) if softened else 1 / np.maximum(np.maximum(d2, clamp2), np.finfo(np.float64).tiny)
        weight = cosine * emission * falloff / np.pi
        lit = np.flatnonzero(weight > 0)
        if shadows and lit.size:
            lit = lit[engine.visible(gbuffer, int(y), int(x), lights.position[lit])]
        result[y, x] = weight[lit] @ flux[lit]
        if progress and done % 256 == 0:
            progress(done / len(pixels))
    return result
