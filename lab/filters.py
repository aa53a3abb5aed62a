"""The edge-stopping filters on torch and kornia: backend ``kornia``, and the reference of the fused kernels.

Numerator S and denominator D of the shadow ratio are filtered with one shared set of tap weights and divided later.
``atrous`` and ``bilateral`` are kornia's joint bilateral blur; an a-trous pass of step s is one blur of the s x s
sub-images that hold every s-th pixel. ``atrous_plane`` has no kornia counterpart and is torch code. Runs on CUDA where
torch has it. Source: LY19 3.3; edge-stopping wavelets after Dammertz et al. 2010.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.params import Params
from lab.records import FilteredShadows, Floats, GBuffer, ShadowSamples

if TYPE_CHECKING:
    from torch import Tensor

STEPS = (1, 2, 4, 8, 16)
BILATERAL_RADIUS, BILATERAL_SIGMA = 8, 4.0  # pixels
B3_SPLINE = (1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16)
GUIDE_LIMIT = 1e18  # larger guides count as this: a squared distance stays finite in float32
VALUE_LIMIT = 1e30  # a ratio beyond it (S over a vanishing D) counts as this
LUMINANCE = (0.2126, 0.7152, 0.0722)

Pass = Callable[["Tensor", "Tensor"], "Tensor"]  # (signal (1, C, H, W), value (1, 1, H, W)) -> filtered signal


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
        passes = _passes(gbuffer, params, scene_radius)
        per_value = per_sigma(params.sigma_shadow)
        channels = shadows.shadowed.shape[2]
        signal = _tensor(np.concatenate([shadows.shadowed, shadows.weight], axis=2))
        filtered = _pixels(_run(signal, channels, passes, per_value, 0.0))
        area = _filter_light(gbuffer, shadows.area, passes, per_value)
        left_out = shadows.left_out
        if left_out is not None:
            left_out = _filter_light(gbuffer, left_out, passes, per_value)
    return FilteredShadows(
        np.ascontiguousarray(filtered[..., :channels]), np.ascontiguousarray(filtered[..., channels:]), area, left_out
    )


def per_sigma(sigma: float | str, unit: float = 1.0) -> float:
    """A guide's factor, 1 / (sigma unit): 0 for an infinite sigma ("none"), never more than 1e30."""
    if isinstance(sigma, str) or math.isinf(sigma):
        return 0.0
    return min(1.0 / (sigma * unit), 1e30) if sigma * unit > 0 else 1e30


def reflected(pixel: NDArray[np.int64], step: int, length: int) -> NDArray[np.int64]:
    """The pixels that taps at `pixel` (any whole numbers) read in a row of `length` pixels.

    A pass of step s sees s separate sub-images, the pixels of each residue modulo s, and reflects inside its own
    (without repeating the edge; again and again where a sub-image is short). Every residue must have a pixel.
    """
    residue = pixel % step
    size = (length - residue + step - 1) // step
    period = np.maximum(2 * (size - 1), 1)
    index = (pixel - residue) // step % period
    return np.asarray(residue + step * np.where(index < size, index, period - index))


def _require_torch() -> None:
    try:
        import kornia.filters  # noqa: F401
        import torch  # noqa: F401
    except ImportError as error:
        raise LabError(
            f"filter_backend=kornia needs torch and kornia ({error}): "
            "install them with 'make setup EXTRA=kornia', or use filter_backend=fused"
        ) from error


def _tensor(pixels: NDArray[Any]) -> Tensor:
    """(H, W, C) numbers as a (1, C, H, W) float32 tensor on the fastest device."""
    import torch

    device = "cuda" if torch.cuda.is_available() else "cpu"
    planes = np.ascontiguousarray(np.moveaxis(pixels, 2, 0)[None], dtype=np.float32)
    return torch.from_numpy(planes).to(device)


def _pixels(tensor: Tensor) -> Floats:
    pixels: Floats = np.moveaxis(tensor[0].cpu().numpy(), 0, 2)
    return pixels


def _guide(values: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.clip(values, -GUIDE_LIMIT, GUIDE_LIMIT))


def _centred(gbuffer: GBuffer) -> NDArray[np.float64]:
    """Positions relative to the first surface point: a scene far from the origin keeps its precision in float32."""
    position = gbuffer.position.astype(np.float64)
    hits = np.argwhere(gbuffer.depth > 0)
    return np.asarray(position - position[tuple(hits[0])]) if len(hits) else position


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
        guided(partial(_atrous, partial(_plane_blur, per_normal, step) if plane else _joint_blur, step))
        for step in STEPS
    ]


def _joint_guides(gbuffer: GBuffer, params: Params, scene_radius: float) -> Tensor:
    """(1, 6, H, W): normal and position, each over its sigma."""
    normal = _guide(gbuffer.normal.astype(np.float64) * per_sigma(params.sigma_normal))
    position = _guide(_centred(gbuffer) * per_sigma(params.sigma_position, scene_radius))
    return _tensor(np.concatenate([normal, position], axis=2))


def _plane_guides(gbuffer: GBuffer, params: Params) -> Tensor:
    """(1, 8, H, W): normal, position, 1 / (sigma_plane footprint), 1 on surfaces and 0 on background."""
    footprint = gbuffer.depth.astype(np.float64) * gbuffer.pixel_angle
    per_length = np.full(footprint.shape, per_sigma(params.sigma_plane, 0.0))
    np.divide(per_sigma(params.sigma_plane), footprint, out=per_length, where=footprint > 0)
    limits = np.stack([np.minimum(per_length, 1e30), gbuffer.depth > 0], axis=2)
    return _tensor(np.concatenate([gbuffer.normal, _centred(gbuffer), limits], axis=2))


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
    value = ratio
    if numerators == 3:
        value = (ratio * torch.tensor(LUMINANCE, device=ratio.device).view(1, 3, 1, 1)).sum(1, keepdim=True)
    if mean_area > 0:
        value = value / (value + mean_area)
    return (value.clamp(max=VALUE_LIMIT).double() * per_value).clamp(-GUIDE_LIMIT, GUIDE_LIMIT).float()


def _filter_light(gbuffer: GBuffer, light: Floats, passes: list[Pass], per_value: float) -> Floats:
    """Noisy irradiance over a denominator of 1 on surfaces, 0 on background: silhouettes are not darkened."""
    surface = gbuffer.depth > 0
    luminance = light.astype(np.float64) @ LUMINANCE
    mean = float(luminance[surface].mean()) if surface.any() else 0.0
    if not mean > 0:
        return light.copy()
    signal = np.concatenate([light * surface[..., None], surface[..., None]], axis=2)
    filtered = _pixels(_run(_tensor(signal), 3, passes, per_value, mean))
    result = np.zeros_like(light)
    np.divide(filtered[..., :3], filtered[..., 3:], out=result, where=surface[..., None])
    return result


def _atrous(blur: Callable[[Tensor, Tensor], Tensor], step: int, signal: Tensor, guide: Tensor) -> Tensor:
    """One a-trous pass: a 5 x 5 blur of all sub-images of this step, as one batch."""
    height, width = signal.shape[2:]
    rows, columns = _sub_images(height, step), _sub_images(width, step)
    blurred = blur(_deal(signal, rows, columns), _deal(guide, rows, columns))
    inner = blurred.reshape(len(rows), len(columns), *blurred.shape[1:])
    together = inner.permute(2, 3, 0, 4, 1).flatten(3, 4).flatten(1, 2)  # (C, h, ry, w, rx) -> (C, h ry, w rx)
    return together[None, :, :height, :width]


def _joint_blur(signal: Tensor, guide: Tensor, radius: int = 2, sigma: float = 1.0) -> Tensor:
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

    def taps(dy: int, dx: int) -> tuple[slice, ...]:
        return (slice(None), slice(None), *(slice(2 + d, d - 2 or None) for d in (dy, dx)))

    value, normal, position, per_length, surface = torch.split(guide, [1, 3, 3, 1, 1], dim=1)
    centre = taps(0, 0)
    total, weights = torch.zeros_like(signal[centre]), torch.zeros_like(value[centre])
    for dy, along_y in enumerate(B3_SPLINE, -2):
        for dx, along_x in enumerate(B3_SPLINE, -2):
            q = taps(dy, dx)
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


def _sub_images(length: int, step: int) -> NDArray[np.int64]:
    """(sub-images, positions + 4): what each sub-image of a row reads, with two taps of border on either side."""
    count = (length + step - 1) // step
    residue = np.arange(min(step, length))[:, None]
    return reflected(residue + step * np.arange(-2, count + 2), step, length)


def _deal(image: Tensor, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Tensor:
    """(1, C, H, W) to the batch of its sub-images, borders included: (ry rx, C, h, w)."""
    read = _read(image, rows.ravel(), columns.ravel()).reshape(-1, *rows.shape, *columns.shape)
    return read.permute(1, 3, 0, 2, 4).flatten(0, 1)


def _read(image: Tensor, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Tensor:
    """The pixels of (1, C, H, W) at `rows` x `columns`."""
    import torch

    for axis, index in ((2, rows), (3, columns)):
        image = image.index_select(axis, torch.from_numpy(index).to(image.device))
    return image


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
            blurred = _joint_blur(_read(signal, rows, columns), _read(guide, rows, columns), radius, BILATERAL_SIGMA)
            result[..., top:bottom, left:right] = blurred
    return result
