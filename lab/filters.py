"""The edge-stopping filters on torch and kornia: backend ``kornia``, and the reference of the fused kernels.

Numerator S and denominator D of the shadow ratio are filtered with one shared set of tap weights and divided later.
``atrous`` and ``bilateral`` are kornia's joint bilateral blur; an a-trous pass of step s is one blur of the s x s
sub-images that hold every s-th pixel. ``atrous_plane`` and ``atrous_variance`` (in :mod:`lab.filters_variance`) have no
kornia counterpart and are torch code. Runs on CUDA where torch has it.
Source: LY19 3.3; edge-stopping wavelets after Dammertz et al. 2010.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.filters_images import (
    BORDER,
    LUMINANCE,
    STEPS,
    at_tap,
    by_sub_images,
    luminance,
    pixels,
    read,
    reflected,
    tensor,
)
from lab.filters_variance import filter_by_variance
from lab.params import Params
from lab.records import FilteredShadows, Floats, GBuffer, ShadowSamples

if TYPE_CHECKING:
    from torch import Tensor

BILATERAL_RADIUS, BILATERAL_SIGMA = 8, 4.0  # pixels
B3_SPLINE = (1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16)
GUIDE_LIMIT = 1e18  # larger guides count as this: a squared distance stays finite in float32
VALUE_LIMIT = 1e30  # a ratio beyond it (S over a vanishing D) counts as this

Pass = Callable[["Tensor", "Tensor"], "Tensor"]  # (signal (1, C, H, W), value (1, 1, H, W)) -> filtered signal
Run = Callable[["Tensor", int, float], "Tensor"]  # (signal, numerators, mean light or 0) -> signal after all passes


def filter_shadows(gbuffer: GBuffer, shadows: ShadowSamples, params: Params, scene_radius: float) -> FilteredShadows:
    """Filters S, its weight and the area lights' irradiance as ``params.filter`` says.

    `scene_radius` is in the scene's unit. The result equals the fused kernel's within 1e-4 of the signal's scale.
    Errors: :class:`LabError` where torch or kornia is not installed.
    """
    if params.filter == "none":
        left_out = None if shadows.left_out is None else shadows.left_out.copy()
        return FilteredShadows(shadows.shadowed.copy(), shadows.weight.copy(), shadows.area.copy(), left_out)
    _require_torch()
    import torch

    with torch.inference_mode():
        run = _run_of(gbuffer, params, scene_radius)
        channels = shadows.shadowed.shape[2]
        signal = tensor(np.concatenate([shadows.shadowed, shadows.weight], axis=2))
        filtered = pixels(run(signal, channels, 0.0))
        area = _filter_light(gbuffer, shadows.area, run)
        left_out = shadows.left_out
        if left_out is not None:
            left_out = _filter_light(gbuffer, left_out, _run_of(gbuffer, by_geometry_alone(params), scene_radius))
    return FilteredShadows(
        np.ascontiguousarray(filtered[..., :channels]), np.ascontiguousarray(filtered[..., channels:]), area, left_out
    )


def by_geometry_alone(params: Params) -> Params:
    """For what the clamp leaves out: few short paths find it, and a guide by its own value would throw them away."""
    return params.replace(sigma_shadow="none", sigma_deviation="none")


def per_sigma(sigma: float | str, unit: float = 1.0) -> float:
    """A guide's factor, 1 / (sigma unit): 0 for an infinite sigma ("none"), never more than 1e30."""
    if isinstance(sigma, str) or math.isinf(sigma):
        return 0.0
    return min(1.0 / (sigma * unit), 1e30) if sigma * unit > 0 else 1e30


def _require_torch() -> None:
    try:
        import kornia.filters  # noqa: F401
        import torch  # noqa: F401
    except ImportError as error:
        raise LabError(
            f"filter_backend=kornia needs torch and kornia ({error}): "
            "install them with 'make setup EXTRA=kornia', or use filter_backend=fused"
        ) from error


def _guide(values: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.clip(values, -GUIDE_LIMIT, GUIDE_LIMIT))


def _centred(gbuffer: GBuffer) -> NDArray[np.float64]:
    """Positions relative to the first surface point: a scene far from the origin keeps its precision in float32."""
    position = gbuffer.position.astype(np.float64)
    hits = np.argwhere(gbuffer.depth > 0)
    return np.asarray(position - position[tuple(hits[0])]) if len(hits) else position


def _run_of(gbuffer: GBuffer, params: Params, scene_radius: float) -> Run:
    """All passes of the filter, with the guides that stay the same bound in."""
    import torch

    if params.filter == "atrous_variance":
        surface = tensor((gbuffer.depth > 0)[..., None])
        geometry = torch.cat([_joint_guides(gbuffer, params, scene_radius), surface], dim=1)
        tolerance = float(params.to_core()["sigma_deviation"])
        return lambda signal, numerators, mean: filter_by_variance(signal, numerators, mean or 1.0, tolerance, geometry)
    passes, per_value = _passes(gbuffer, params, scene_radius), per_sigma(params.sigma_shadow)
    return lambda signal, numerators, mean: _run(signal, numerators, passes, per_value, mean)


def _passes(gbuffer: GBuffer, params: Params, scene_radius: float) -> list[Pass]:
    """One function a pass, with the guides that stay the same bound in."""
    import torch

    plane = params.filter == "atrous_plane"
    geometry = _plane_guides(gbuffer, params) if plane else _joint_guides(gbuffer, params, scene_radius)

    def guided(blur: Callable[[Tensor, Tensor], Tensor]) -> Pass:
        return lambda signal, value: blur(signal, torch.cat([value, geometry], dim=1))

    if params.filter == "bilateral":
        return [guided(_bilateral)]
    per_normal = min(per_sigma(params.sigma_normal), GUIDE_LIMIT)
    return [
        guided(partial(by_sub_images, partial(_plane_blur, per_normal, step) if plane else _joint_blur, step))
        for step in STEPS
    ]


def _joint_guides(gbuffer: GBuffer, params: Params, scene_radius: float) -> Tensor:
    """(1, 6, H, W): normal and position, each over its sigma."""
    normal = _guide(gbuffer.normal.astype(np.float64) * per_sigma(params.sigma_normal))
    position = _guide(_centred(gbuffer) * per_sigma(params.sigma_position, scene_radius))
    return tensor(np.concatenate([normal, position], axis=2))


def _plane_guides(gbuffer: GBuffer, params: Params) -> Tensor:
    """(1, 8, H, W): normal, position, 1 / (sigma_plane footprint), 1 on surfaces and 0 on background."""
    footprint = gbuffer.depth.astype(np.float64) * gbuffer.pixel_angle
    per_length = np.full(footprint.shape, per_sigma(params.sigma_plane, 0.0))
    np.divide(per_sigma(params.sigma_plane), footprint, out=per_length, where=footprint > 0)
    limits = np.stack([np.minimum(per_length, 1e30), gbuffer.depth > 0], axis=2)
    return tensor(np.concatenate([gbuffer.normal, _centred(gbuffer), limits], axis=2))


def _run(signal: Tensor, numerators: int, passes: list[Pass], per_value: float, mean_area: float) -> Tensor:
    """`signal` (1, C, H, W) after all passes: `numerators` channels first, then their denominators (or the one).

    `mean_area` > 0 makes the guiding value of an unbounded luminance l scale-free: l / (l + mean).
    """
    for filter_pass in passes:
        signal = filter_pass(signal, _value(signal, numerators, per_value, mean_area))
    return signal


def _value(signal: Tensor, numerators: int, per_value: float, mean_area: float) -> Tensor:
    """The guiding value (1, 1, H, W) over its sigma: the shadow ratio or relative area light of this pass's input."""
    import torch

    below = signal[:, numerators:]
    ratio = torch.where(below > 0, signal[:, :numerators] / below, torch.zeros_like(signal[:, :numerators]))
    value = luminance(ratio)
    if mean_area > 0:
        value = value / (value + mean_area)
    return (value.clamp(max=VALUE_LIMIT).double() * per_value).clamp(-GUIDE_LIMIT, GUIDE_LIMIT).float()


def _filter_light(gbuffer: GBuffer, light: Floats, run: Run) -> Floats:
    """Noisy irradiance over a denominator of 1 on surfaces, 0 on background: silhouettes are not darkened."""
    surface = gbuffer.depth > 0
    mean = float((light.astype(np.float64) @ LUMINANCE)[surface].mean()) if surface.any() else 0.0
    if not mean > 0:
        return light.copy()
    signal = np.concatenate([light * surface[..., None], surface[..., None]], axis=2)
    filtered = pixels(run(tensor(signal), 3, mean))
    result = np.zeros_like(light)
    np.divide(filtered[..., :3], filtered[..., 3:], out=result, where=surface[..., None])
    return result


def _joint_blur(signal: Tensor, guide: Tensor, radius: int = BORDER, sigma: float = 1.0) -> Tensor:
    """Kornia's joint bilateral blur, (n, C, h, w) to (n, C, h - 2 radius, w - 2 radius)."""
    from kornia.filters import joint_bilateral_blur

    blurred: Tensor = joint_bilateral_blur(
        signal, guide, 2 * radius + 1, sigma_color=1.0, sigma_space=(sigma, sigma), color_distance_type="l2"
    )
    return blurred[..., radius:-radius, radius:-radius]


def _plane_blur(per_normal: float, step: int, signal: Tensor, guide: Tensor) -> Tensor:
    """B3 spline stopped by the distance from the pixel's plane, the normal and the value; crops as `_joint_blur`.

    `guide`: (n, 9, h, w), the value and `_plane_guides`.
    """
    import torch

    value, normal, position, per_length, surface = torch.split(guide, [1, 3, 3, 1, 1], dim=1)
    centre = at_tap(0, 0)
    total, weights = torch.zeros_like(signal[centre]), torch.zeros_like(value[centre])
    for dy, along_y in enumerate(B3_SPLINE, -2):
        for dx, along_x in enumerate(B3_SPLINE, -2):
            q = at_tap(dy, dx)
            height = (normal[centre] * (position[q] - position[centre])).sum(1, keepdim=True)
            plane = height * per_length[centre] / step
            normals = ((normal[q] - normal[centre]) * per_normal).square().sum(1, keepdim=True)
            distance = plane.square() + normals + (value[q] - value[centre]).square()
            falloff = (-0.5 * distance).exp().nan_to_num(nan=0.0)  # out of float32's range: so far away
            weight = along_y * along_x * falloff * surface[centre] * surface[q]
            if dx == 0 and dy == 0:  # a pixel always counts for itself: background keeps its own value
                weight = torch.full_like(weight, along_y * along_x)
            total += weight * signal[q]
            weights += weight
    return total / weights


def _bilateral(signal: Tensor, guide: Tensor) -> Tensor:
    """One 17 x 17 blur, in tiles: in one piece it could need 8 KB a pixel."""
    import torch

    radius, tile = BILATERAL_RADIUS, 240 if signal.device.type == "cpu" else 128
    height, width = signal.shape[2:]
    result = torch.empty_like(signal)
    for top in range(0, height, tile):
        for left in range(0, width, tile):
            bottom, right = min(top + tile, height), min(left + tile, width)
            rows = reflected(np.arange(top - radius, bottom + radius), 1, height)
            columns = reflected(np.arange(left - radius, right + radius), 1, width)
            blurred = _joint_blur(read(signal, rows, columns), read(guide, rows, columns), radius, BILATERAL_SIGMA)
            result[..., top:bottom, left:right] = blurred
    return result
