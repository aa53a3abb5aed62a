"""Stage light on the device: tiles of pixels, each with its own culled lists of lights (LY19 3.2, 3.3)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.hierarchy import hierarchy_parts
from lab.engine.vulkan.lighting import device_lighting, take_lighting
from lab.engine.vulkan.uniforms import params_uniform
from lab.params import Params
from lab.records import GBuffer, Hierarchy, Lighting

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu

_LANES = 64  # threads of a workgroup, as in light_tiled.slang
_IN_REGISTERS = 8  # shadow samples that one run picks; more take several runs


def light(
    gpu: Gpu, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, scene_radius: float, *, counts: bool
) -> Lighting:
    """The unshadowed light of every pixel and its shadow samples; see :class:`~lab.engine.engine.Engine`."""
    lights, view = hierarchy_parts(gpu, hierarchy), gbuffer_parts(gpu, gbuffer)
    n, samples = params.interleave, params.shadow_samples
    # A row of points is cut into runs, a picture into squares.
    tile = (_LANES, 1) if view.height == 1 else (8, _LANES // 8)
    tiles = [-(-length // (edge * n)) for length, edge in zip((view.width, view.height), tile, strict=True)]

    visited = gpu.pool.take(tiles[0] * tiles[1] * n * n, "u4", "visited")
    made = replace(take_lighting(gpu, lights, view, samples, counts), visited=visited)
    with gpu.stage("light") as encoder:
        for counted in (made.overdraw, made.lights_used):
            if counts and counted is not None:  # levels that are not drawn, pixels that see nothing
                encoder.clear_buffer(counted.raw)
        for first in range(0, max(samples, 1), _IN_REGISTERS):
            constants = {
                "samples": min(samples - first, _IN_REGISTERS),
                "race": int(params.picker == "race"),
                "counts": int(counts and first == 0),
            }
            gpu.program("light_tiled", "light", constants).dispatch(
                encoder,
                [tiles[0] * _LANES, tiles[1], n * n],
                info=lights.info,
                lights=lights.lights,
                position_depth=view.position,
                normals=view.normal,
                irradiance=made.irradiance,
                picked_light=made.light,
                target_weight=made.target_weight,
                overdraw=made.overdraw,
                lights_used=made.lights_used,
                visited=visited,
                size=(view.width, view.height),
                tile_width=tile[0],
                first_sample=first,
                tiles=tiles,
                scene_radius=scene_radius,
                params=params_uniform(params),
            )
    return device_lighting(made if counts else replace(made, overdraw=None, lights_used=None))
