"""Stage filter_shadows on the device: the fused edge-stopping filters (LY19 3.3)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import GBufferParts, gbuffer_parts
from lab.engine.vulkan.layouts import SIGNAL_SCALE
from lab.engine.vulkan.shadows import SignalParts, device_filtered, signal_parts
from lab.filters import by_geometry_alone, per_sigma
from lab.params import SETTINGS, Params
from lab.records import FilteredShadows, GBuffer, ShadowSamples

if TYPE_CHECKING:
    import slangpy as spy

    from lab.engine.vulkan.device import Gpu

_STEPS = (1, 2, 4, 8, 16)
_PARTIAL_SUMS = 64  # as in filter_shadows.slang
_RATIO, _LIGHT, _RATIO_RGB = 0, 1, 2
_NO_TOLERANCE = 1e9


def filter_shadows(
    gpu: Gpu, gbuffer: GBuffer, shadows: ShadowSamples, params: Params, scene_radius: float
) -> FilteredShadows:
    """S, its weight and the noisy irradiances, filtered; see :class:`~lab.engine.engine.Engine`.

    ``filter_backend=kornia`` reads the records back and filters them with torch.
    """
    if params.filter_backend == "kornia":
        from lab import filters

        return filters.filter_shadows(gbuffer, shadows, params, scene_radius)
    signal = signal_parts(gpu, shadows)
    if params.filter == "none":
        return device_filtered(signal)
    view, pool = gbuffer_parts(gpu, gbuffer), gpu.pool
    made = replace(
        signal,
        shadowed=pool.take(len(signal.shadowed), "f4", "filtered S"),
        weight=pool.take(len(signal.weight), "f4", "filtered weight"),
        area=pool.take(view.pixels, "4f4", "filtered area light"),
        left_out=signal.left_out and pool.take(view.pixels, "4f4", "filtered left out"),
    )
    with gpu.stage("filter_shadows") as encoder:
        run = _Run(gpu, encoder, view, params, _guides(view, params, scene_radius))
        run.filter(_RATIO if signal.channels == 1 else _RATIO_RGB, signal, signal.area, made, made.area)
        run.filter(_LIGHT, signal, signal.area, made, made.area)
        if signal.left_out is not None and made.left_out is not None:
            run = replace(run, guides=_guides(view, by_geometry_alone(params), scene_radius))
            run.filter(_LIGHT, signal, signal.left_out, made, made.left_out)
    return device_filtered(made)


def _guides(view: GBufferParts, params: Params, scene_radius: float) -> dict[str, float]:
    """``Guides`` of the shader."""
    return {
        "per_value": per_sigma(params.sigma_shadow),
        "per_normal": per_sigma(params.sigma_normal),
        "per_position": per_sigma(params.sigma_position, scene_radius),
        "per_plane": per_sigma(params.sigma_plane),
        "tolerance": min(float(params.to_core()["sigma_deviation"]), _NO_TOLERANCE),
        "pixel_angle": view.pixel_angle,
        "width": view.width,
        "height": view.height,
    }


@dataclass(frozen=True)
class _Picture:
    """What a pass reads or writes: the signal in two buffers, and the value that guides."""

    first: DeviceBuffer
    second: DeviceBuffer
    guide: DeviceBuffer


@dataclass(frozen=True)
class _Run:
    """The filter of one frame, being recorded."""

    gpu: Gpu
    encoder: spy.CommandEncoder
    view: GBufferParts
    params: Params
    guides: dict[str, float]

    def filter(
        self, kind: int, signal: SignalParts, irradiance: DeviceBuffer, made: SignalParts, filtered: DeviceBuffer
    ) -> None:
        """A ratio, `signal`'s to `made`, or (kind ``_LIGHT``) noisy `irradiance` to `filtered`."""
        pool, pixels = self.gpu.pool, self.view.pixels
        now, after = self._picture(kind), self._picture(kind)
        scale = pool.take(1, SIGNAL_SCALE, "signal scale")
        partial = pool.take(_PARTIAL_SUMS, "4f4", "partial sums")
        size, surface = [self.view.width, self.view.height, 1], {"position_depth": self.view.position}
        surfaces = surface | {"normals": self.view.normal, "scale": scale, "guides": self.guides}
        inputs = {"shadowed": signal.shadowed, "weight": signal.weight, "irradiance": irradiance}

        def dispatch(entry: str, threads: list[int], **values: Any) -> None:
            constants = {"kind": kind, "method": SETTINGS["filter"].choices.index(self.params.filter)}
            self.gpu.program("filter_shadows", entry, constants).dispatch(self.encoder, threads, **values)

        signals = {"first": now.first, "second": now.second}
        dispatch("pack", [256 * _PARTIAL_SUMS, 1, 1], partial=partial, pixels=pixels, **surface, **inputs, **signals)
        dispatch("measure_scale", [256, 1, 1], partial=partial, scale=scale, pixels=pixels)
        dispatch("take_values", size, guide=now.guide, scale=scale, guides=self.guides, **signals)
        if self.params.filter == "atrous_variance":
            dispatch("measure_variance", size, luminances=now.guide, first=now.first, **surfaces)
            dispatch("make_first_guide", size, luminances=now.guide, first=now.first, guide=after.guide, **surfaces)
            now, after = replace(now, guide=after.guide), replace(after, guide=now.guide)
        for step in (1,) if self.params.filter == "bilateral" else _STEPS:
            dispatch(
                "filter_pass", size, step=step, first=now.first, second=now.second, guide=now.guide,
                first_out=after.first, second_out=after.second, guide_out=after.guide, **surfaces,
            )  # fmt: skip
            now, after = after, now
        results = {"shadowed": made.shadowed, "weight": made.weight, "filtered": filtered}
        dispatch(
            "unpack", [pixels, 1, 1], first=now.first, second=now.second, scale=scale, irradiance=irradiance,
            pixels=pixels, **surface, **results,
        )  # fmt: skip

    def _picture(self, kind: int) -> _Picture:
        pixels, take = self.view.pixels, self.gpu.pool.take
        second = take(1 if kind == _RATIO else pixels, "4f4", "denominators")
        return _Picture(take(pixels, "4f4", "signal"), second, take(pixels, "2f4", "guide"))
