"""How many pairs of pixel and light a second a plain kernel evaluates on perfect lists: for ``lab bench``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.hierarchy import hierarchy_parts
from lab.engine.vulkan.limits import seconds
from lab.engine.vulkan.uniforms import params_uniform
from lab.records import Frame

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.engine import VulkanEngine

_LANES, _EDGE = 64, 8  # as in limit_light.slang
_LONGEST = 4096
_PICKS = 8


class LightLimit:
    """Lists of lights that add light to every pixel of some tiles of a frame, and a kernel that runs through them."""

    def __init__(self, engine: VulkanEngine, frame: Frame, *, tiles: int, groups: int) -> None:
        """Looks for them in about so many tiles, evenly over the picture; `groups`: workgroups of a run, at least."""
        gpu, params = engine.gpu, frame.params
        view, levels = gbuffer_parts(gpu, frame.gbuffer), hierarchy_parts(gpu, frame.hierarchy)
        self._gpu, self._params = gpu, params
        size = frame.gbuffer.size
        chosen = _tiles(size, params.interleave, tiles)
        self._values: dict[str, Any] = {
            "info": levels.info,
            "lights": levels.lights,
            "position_depth": view.position,
            "normals": view.normal,
            "size": size,
            "longest": _LONGEST,
            "scene_radius": engine.scene_radius,
            "params": params_uniform(params),
        }
        length = gpu.pool.take(len(chosen), "u4", "list lengths")
        found = gpu.pool.take(len(chosen) * _LONGEST, "u4", "perfect lists")
        total = len(frame.hierarchy.position)
        if len(chosen):
            with gpu.stage("limit") as encoder:
                encoder.clear_buffer(length.raw)
                gpu.program("limit_light", "find_lists").dispatch(
                    encoder,
                    [total, len(chosen), 1],
                    tiles=gpu.pool.upload(chosen, "tiles"),
                    length=length,
                    list=found,
                    total=total,
                    **self._values,
                )
        lengths = np.minimum(length.numpy(), _LONGEST)
        kept = np.flatnonzero(lengths)
        rows = found.numpy().reshape(-1, _LONGEST)[kept]
        self._lists = len(kept)
        self._groups = self._lists * -(-groups // self._lists) if self._lists else 0
        self.pairs = int(lengths.sum(dtype=np.int64)) * _LANES * (self._groups // max(self._lists, 1))
        self.tiles = chosen[kept]
        self._values |= {
            "tiles": gpu.pool.upload(self.tiles, "tiles"),
            "length": gpu.pool.upload(lengths[kept], "list lengths"),
            "list": gpu.pool.upload(rows.reshape(-1), "perfect lists"),
            "lists": self._lists,
            "irradiance": gpu.pool.take(self._groups * _LANES, "4f4", "plain irradiance"),
            "picked": gpu.pool.take(self._groups * _LANES, "u4", "plain picks"),
        }

    def rate(self) -> float:
        """Pairs a second; 0 where there are no lists."""
        return self.pairs / seconds(self._gpu, self._record) if self._lists else 0.0

    def irradiance(self) -> NDArray[np.float32]:
        """(lists, 64, 3) of the last run: what the lists send to the pixels of their tiles."""
        rows: NDArray[np.float32] = self._values["irradiance"].numpy(self._lists * _LANES)
        return rows.reshape(-1, _LANES, 4)[:, :, :3]

    def _record(self, encoder: spy.CommandEncoder) -> None:
        params = self._params
        for first in range(0, max(params.shadow_samples, 1), _PICKS):
            constants = {
                "samples": min(params.shadow_samples - first, _PICKS),
                "race": int(params.picker == "race"),
            }
            program = self._gpu.program("limit_light", "light_lists", constants)
            program.dispatch(encoder, [self._groups * _LANES, 1, 1], **self._values)


def _tiles(size: tuple[int, int], interleave: int, wanted: int) -> NDArray[np.uint32]:
    """(t, 4): column and row of a tile of 8 by 8 pixels, and which of the n^2 interleaved pictures it is of."""
    columns, rows = (length // (_EDGE * interleave) for length in size)
    count = columns * rows * interleave**2
    numbers = np.arange(0, count, max(1, count // wanted))
    picture, place = numbers % interleave**2, numbers // interleave**2
    return np.stack([place % max(columns, 1), place // max(columns, 1), picture, 0 * place], axis=1).astype(np.uint32)
