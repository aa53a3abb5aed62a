"""Stage composite on the device: interleaved tiles recombined, shadows applied, direct light added (LY19 4.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.gbuffer import gbuffer_parts, plane_of, rgb_of
from lab.engine.vulkan.hierarchy import HierarchyParts
from lab.engine.vulkan.lighting import lighting_parts
from lab.engine.vulkan.records import device_record
from lab.engine.vulkan.shadows import shadow_parts, signal_parts
from lab.engine.vulkan.uniforms import params_uniform
from lab.params import Params
from lab.records import FilteredShadows, Floats, GBuffer, Image, Lighting, ShadowSamples

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu


@dataclass(frozen=True)
class ImageParts:
    """The buffers of the image: four floats a pixel, the fourth 1; `shadow_ratio` 1 or 3 floats a pixel."""

    colour: DeviceBuffer
    direct: DeviceBuffer
    unshadowed: DeviceBuffer
    indirect: DeviceBuffer
    shadow_ratio: DeviceBuffer


def composite(
    gpu: Gpu,
    gbuffer: GBuffer,
    lighting: Lighting,
    shadows: ShadowSamples,
    filtered: FilteredShadows,
    *,
    background: Sequence[float],
    params: Params,
) -> Image:
    """The final image; see :class:`~lab.engine.engine.Engine`. `background`: radiance where nothing is hit."""
    view, pool = gbuffer_parts(gpu, gbuffer), gpu.pool
    lit = lighting_parts(gpu, lighting)
    signal, direct_light = signal_parts(gpu, filtered), shadow_parts(gpu, shadows).direct
    size, pixels, channels = (view.width, view.height), view.pixels, signal.channels
    ratios = pool.take(pixels, "4f4", "shadow ratios")
    names = ("colour", "direct", "unshadowed", "indirect")
    made = ImageParts(
        **{name: pool.take(pixels, "4f4", name) for name in names},
        shadow_ratio=pool.take(pixels * channels, "f4", "shadow ratio"),
    )
    settings = params_uniform(params)
    compensated = {"compensated": int(signal.left_out is not None)}
    with gpu.stage("composite") as encoder:
        gpu.program("composite", "take_ratios", {"channels": channels}).dispatch(
            encoder,
            [*size, 1],
            position_depth=view.position,
            shadowed=signal.shadowed,
            weight=signal.weight,
            ratios=ratios,
            size=size,
            params=settings,
        )
        gpu.program("composite", "composite", {"channels": channels, **compensated}).dispatch(
            encoder,
            [*size, 1],
            position_depth=view.position,
            normals=view.normal,
            albedo=view.albedo,
            emission=view.emission,
            irradiance=lit.irradiance,
            ratios=ratios,
            direct_light=direct_light,
            area_light=signal.area,
            left_out=signal.left_out or signal.area,
            size=size,
            pixel_angle=view.pixel_angle,
            background=background,
            params=settings,
            **{name: getattr(made, name) for name in (*names, "shadow_ratio")},
        )
    shape = view.height, view.width
    fields = {name: rgb_of(getattr(made, name), shape) for name in names}
    if lit.lit_by is not None:
        fields["colour"] = _checked(lit.lit_by, fields["colour"])
    return device_record(Image, made, {**fields, "shadow_ratio": plane_of(made.shadow_ratio, *shape, channels)})


def _checked(hierarchy: HierarchyParts, read: Callable[[], Floats]) -> Callable[[], Floats]:
    """`read`, after a look whether all lights had room: a picture that lacks some must not pass for one."""

    def checked() -> Floats:
        _ = hierarchy.on_host
        return read()

    return checked
