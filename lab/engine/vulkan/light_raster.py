"""Stage light on the device, the paper's way: one rasterised cube a light, added up by blending (LY19 3.2, 3.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from lab.engine.engine import check_lighting
from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.gbuffer import GBufferParts, gbuffer_parts
from lab.engine.vulkan.hierarchy import hierarchy_parts
from lab.engine.vulkan.lighting import device_lighting, take_lighting
from lab.engine.vulkan.program import RasterShaders
from lab.engine.vulkan.uniforms import params_uniform
from lab.errors import LabError
from lab.params import Params
from lab.records import GBuffer, Hierarchy, Lighting

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.buffers import DeviceBuffer
    from lab.engine.vulkan.device import Gpu

_PICKERS = {"none": 1, "locked": 2, "atomic_race": 3}  # `picker` of light_raster.slang; 0: no samples
_SUM, _OTHER_SUM = "rgba32_float", "r32_float"
_DEPTH = RasterShaders("whole_target", "scene_depth", writes_depth=True)
_LIGHT = RasterShaders("cube", "light", strip=True, adds_to=(_SUM,))
_LIGHT_TWO_SUMS = RasterShaders("cube", "light_two_sums", strip=True, adds_to=(_SUM, _OTHER_SUM))
_MOST_BYTES = 2**32 - 1  # of a storage buffer, on any card


@dataclass(frozen=True)
class _Targets:
    """Textures that all tiles of a picture are drawn into, side by side."""

    width: int
    height: int
    sums: spy.Texture
    other_sums: spy.Texture
    depth: spy.Texture


@dataclass(frozen=True)
class _Picks:
    """What fragments keep of the shadow samples; a single row where these settings need none.

    Attributes:
        race: u8, a row a sample.    reservoirs: u4, two sums and the samples of each pixel.    locks: u4, of pixels.

    """

    race: DeviceBuffer
    reservoirs: DeviceBuffer
    locks: DeviceBuffer


class RasterLighter:
    """Rasterised lighting; keeps its targets from frame to frame."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._kept: _Targets | None = None

    def light(
        self, hierarchy: Hierarchy, gbuffer: GBuffer, params: Params, scene_radius: float, *, counts: bool
    ) -> Lighting:
        """The unshadowed light of every pixel and its shadow samples; see :class:`~lab.engine.engine.Engine`.

        The G-buffer must come from stage render_gbuffer of this engine, since cubes are drawn through its camera.
        """
        check_lighting("vulkan", params)
        gpu, lights, view = self._gpu, hierarchy_parts(self._gpu, hierarchy), gbuffer_parts(self._gpu, gbuffer)
        if view.camera is None:
            raise LabError(
                "lighting=raster draws through the camera, which this G-buffer does not come with: take one of the "
                "Vulkan engine's render_gbuffer, or lighting=tiled"
            )
        n = params.interleave
        each = -(-view.width // n), -(-view.height // n)
        targets = self._targets(n * each[0], n * each[1])
        images = {"size": (view.width, view.height), "each": each, "n": n}
        picker = _PICKERS[params.reservoir_locks] if params.shadow_samples else 0
        two_sums = params.shadow_samples > 0 and params.first_shadow_level > params.first_level
        picks = self._picks(view, params)
        fragments = gpu.pool.take(view.pixels if counts else 1, "u4", "fragments")
        made = replace(take_lighting(gpu, lights, view, params.shadow_samples, counts), fragments=fragments)
        read = {
            "info": lights.info,
            "lights": lights.lights,
            "position_depth": view.position,
            "normals": view.normal,
            "images": images,
            "scene_radius": scene_radius,
            "params": params_uniform(params),
        }
        draws = gpu.pool.take(1, "4u4", "draw of lights")
        resolve = {"picker": picker, "two_sums": int(two_sums)}
        depth = gpu.raster_program("light_raster_depth", _DEPTH)
        cubes = gpu.raster_program(
            "light_raster", _LIGHT_TWO_SUMS if two_sums else _LIGHT, {"picker": picker, "counts": int(counts)}
        )
        # Nearer than this all depths are one, and cubes are not held back by them.
        depth_unit = 1e-3 * view.reach
        with gpu.stage("light") as encoder:
            for buffer in (made.overdraw, made.lights_used, made.fragments, picks.race, picks.reservoirs, picks.locks):
                if buffer is not None:
                    encoder.clear_buffer(buffer.raw)
            gpu.program("light_raster_resolve", "arguments", resolve).dispatch(
                encoder, [1, 1, 1], info=lights.info, params=read["params"], draw=draws
            )
            _prepare(encoder, [lights.info, lights.lights, view.position, view.normal], draws)
            with _render_pass(encoder, targets, two_sums) as work:
                whole = (0, 0, targets.width, targets.height)
                depth.draw(work, whole, 3, position_depth=view.position, images=images, depth_unit=depth_unit)
                for tile in range(n * n):
                    cubes.draw(
                        work,
                        (tile % n * each[0], tile // n * each[1], *each),
                        draws,
                        **read,
                        camera=view.camera,
                        tile=tile,
                        depth_unit=depth_unit,
                        reach=view.reach,
                        fragments=fragments,
                        overdraw=made.overdraw,
                        lights_used=made.lights_used,
                        race_entries=picks.race,
                        reservoirs=picks.reservoirs,
                        locked_reservoirs=picks.reservoirs,
                        locks=picks.locks,
                    )
            gpu.program("light_raster_resolve", "resolve", resolve).dispatch(
                encoder,
                [view.width, view.height, 1],
                **read,
                sums=targets.sums,
                other_sums=targets.other_sums,
                race_entries=picks.race,
                reservoirs=picks.reservoirs,
                irradiance=made.irradiance,
                picked_light=made.light,
                target_weight=made.target_weight,
            )
        return device_lighting(made if counts else replace(made, overdraw=None, lights_used=None, fragments=None))

    def _targets(self, width: int, height: int) -> _Targets:
        """Those of the last frame, if they have this size."""
        if self._kept is None or (self._kept.width, self._kept.height) != (width, height):
            spy, device = import_slangpy(), self._gpu.device
            colour = spy.TextureUsage.render_target | spy.TextureUsage.unordered_access

            def texture(name: str, usage: Any, label: str) -> Any:
                form = getattr(spy.Format, name)
                return device.create_texture(format=form, width=width, height=height, usage=usage, label=label)

            self._kept = _Targets(
                width,
                height,
                texture(_SUM, colour, "sums of light"),
                texture(_OTHER_SUM, colour, "other sums of target weights"),
                texture("d32_float", spy.TextureUsage.depth_stencil, "depth"),
            )
        return self._kept

    def _picks(self, view: GBufferParts, params: Params) -> _Picks:
        pool, locks = self._gpu.pool, params.reservoir_locks if params.shadow_samples else ""
        check_size((view.width, view.height), params)
        race = view.pixels * params.shadow_samples if locks == "atomic_race" else 1
        reservoirs = view.pixels * (params.shadow_samples + 2) if locks in ("none", "locked") else 1
        return _Picks(
            pool.take(race, "u8", "race of lights"),
            pool.take(reservoirs, "u4", "reservoirs"),
            pool.take(view.pixels if locks == "locked" else 1, "u4", "locks"),
        )


def check_size(size: tuple[int, int], params: Params) -> None:
    """Raises :class:`LabError` where the shadow samples of so many pixels (width, height) don't fit one buffer."""
    samples = params.shadow_samples
    nbytes = size[0] * size[1] * (8 * samples if params.reservoir_locks == "atomic_race" else 4 * (samples + 2))
    if samples and nbytes > _MOST_BYTES:
        raise LabError(
            f"lighting=raster: {samples} shadow samples of {size[0]}x{size[1]} pixels take {nbytes / 2**30:.1f} GiB in "
            "one buffer, which holds 4 at most; choose fewer of either, or lighting=tiled"
        )


def _prepare(encoder: spy.CommandEncoder, read: Sequence[DeviceBuffer], draws: DeviceBuffer) -> None:
    """What must come before a render pass, as no barrier may stand within it."""
    states = import_slangpy().ResourceState
    for buffer in read:
        encoder.set_buffer_state(buffer.raw, states.shader_resource)
    encoder.set_buffer_state(draws.raw, states.indirect_argument)
    encoder.global_barrier()


@contextmanager
def _render_pass(encoder: spy.CommandEncoder, targets: _Targets, two_sums: bool) -> Iterator[spy.RenderPassEncoder]:
    """Draws into cleared targets; what comes after waits for them."""
    spy = import_slangpy()
    clear, store, drop = spy.LoadOp.clear, spy.StoreOp.store, spy.StoreOp.dont_care
    colours = [targets.sums, targets.other_sums] if two_sums else [targets.sums]
    with encoder.begin_render_pass(
        {
            "color_attachments": [
                {"view": texture.create_view(), "load_op": clear, "clear_value": [0.0] * 4, "store_op": store}
                for texture in colours
            ],
            "depth_stencil_attachment": {
                "view": targets.depth.create_view(),
                "depth_load_op": clear,
                "depth_clear_value": 0.0,
                "depth_store_op": drop,
            },
        }
    ) as work:
        yield work
    encoder.global_barrier()
