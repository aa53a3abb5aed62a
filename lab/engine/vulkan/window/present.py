"""A layer of a frame as the picture of a window, made on the device."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lab.colour import HEAT, srgb_decode, srgb_encode
from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.window.layer_values import record_values
from lab.layers import COLOUR, COUNT, DIRECTION, LEVEL, LIGHT, POSITION, SCALAR, TILE, Layer, find_layer
from lab.level_colours import category_table
from lab.records import Frame

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu

_KINDS = {LIGHT: 0, COLOUR: 1, DIRECTION: 2, POSITION: 3, SCALAR: 4, COUNT: 4, LEVEL: 5, TILE: 5}
_BAR = 256  # width of the colour bar
_ENDS = np.dtype([("least", "4u4"), ("greatest", "4u4")])


class Presenter:
    """Draws layers into one texture, which is used again as long as the size stays."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._texture: spy.Texture | None = None
        self._scale: DeviceBuffer | None = None
        self._tables: dict[str, DeviceBuffer] = {}

    def record(
        self, encoder: spy.CommandEncoder, frame: Frame, name: str, exposure: float, *, bar: int, encode: bool = False
    ) -> spy.Texture:
        """The picture of layer `name`, linear unless `encode`.

        `exposure` counts for light. With `bar` other than 0 a colour bar is drawn where the layer has one; where its
        colours are categories there are so many.
        """
        layer, view = find_layer(name), gbuffer_parts(self._gpu, frame.gbuffer)
        size, kind = (view.width, view.height), _KINDS[layer.kind]
        values = record_values(self._gpu, encoder, frame, name)
        self._scale = self._record_scale(encoder, layer, values)
        table, picture = self._table(layer), self._picture(size)
        barred = bar > 0 and layer.kind in (SCALAR, COUNT, LEVEL, TILE)
        self._gpu.program("present", "show", {"kind": kind, "encode": int(encode)}).dispatch(
            encoder,
            [*size, 1],
            values=values,
            scale=self._scale,
            table=table,
            rows=len(table),
            picture=picture,
            size=size,
            exposure=exposure,
            bar=min(_BAR, size[0]) if barred else 0,
            steps=max(bar, 1),
        )
        return picture

    def pixels(self, frame: Frame, name: str, exposure: float) -> NDArray[np.uint8]:
        """(H, W, 3) sRGB bytes of the same picture, without a colour bar; waits for it."""
        encoder = self._gpu.device.create_command_encoder()
        picture = self.record(encoder, frame, name, exposure, bar=0)
        self._gpu.device.submit_command_buffer(encoder.finish())
        linear = picture.to_numpy()[..., :3]
        return np.rint(srgb_encode(linear) * 255).astype(np.uint8)

    def ends(self) -> tuple[float, float]:
        """The values at the two ends of the last picture's colours; reads them back."""
        if self._scale is None:
            return 0.0, 1.0
        low, high = self._scale.numpy()[:, 0]
        return float(low), float(high)

    def _record_scale(self, encoder: spy.CommandEncoder, layer: Layer, values: DeviceBuffer) -> DeviceBuffer:
        pool, program = self._gpu.pool, self._gpu.program
        scale = pool.take(2, "4f4", "scale")
        if layer.kind not in (SCALAR, COUNT, POSITION):
            return scale
        ends = pool.take(1, _ENDS, "ends of values")
        program("present", "clear_ends").dispatch(encoder, [1, 1, 1], ends=ends)
        program("present", "measure_ends").dispatch(
            encoder, [len(values), 1, 1], values=values, ends=ends, pixels=len(values)
        )
        low, high = layer.low, layer.high
        program("present", "settle_scale").dispatch(
            encoder,
            [1, 1, 1],
            ends=ends,
            scale=scale,
            given=(low or 0.0, high or 0.0),
            is_given=(int(low is not None), int(high is not None)),
        )
        return scale

    def _table(self, layer: Layer) -> DeviceBuffer:
        name = layer.kind if layer.kind in (LEVEL, TILE) else layer.colour_map
        if name not in self._tables:
            self._tables[name] = self._gpu.pool.upload(_linear_table(name), f"colours {name}")
        return self._tables[name]

    def _picture(self, size: tuple[int, int]) -> spy.Texture:
        spy, old = import_slangpy(), self._texture
        if old is None or (old.width, old.height) != size:
            usage = spy.TextureUsage
            self._texture = self._gpu.device.create_texture(
                format=spy.Format.rgba32_float,
                width=size[0],
                height=size[1],
                usage=usage.shader_resource | usage.unordered_access | usage.copy_source,
                label="picture of the window",
            )
        assert self._texture is not None
        return self._texture


def _linear_table(name: str) -> NDArray[np.float32]:
    """(n, 4) linear colours: of the categories of a kind, grey, or heat, which every other map is here."""
    if name in (LEVEL, TILE):
        colours = category_table(name)
    else:
        colours = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1) if name == "grey" else HEAT
    rows = np.ones((len(colours), 4), np.float32)
    rows[:, :3] = srgb_decode(colours / 255)
    return rows
