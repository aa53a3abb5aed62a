"""What the tests of the filters share: both backends under one signature, and pictures to filter."""

from __future__ import annotations

import numpy as np
import pytest

from lab import _core, filters
from lab.params import Params
from lab.records import FilteredShadows, GBuffer, ShadowSamples

SIGNALS = ("shadowed", "weight", "area", "left_out")


def fused(gbuffer: GBuffer, shadows: ShadowSamples, params: Params, scene_radius: float) -> FilteredShadows:
    settings, left_out = params.to_core(), shadows.left_out
    if left_out is not None:
        alone = params.replace(sigma_shadow="none", sigma_deviation="none").to_core()
        left_out = _core.filter_irradiance(gbuffer, left_out, alone, scene_radius)
    return FilteredShadows(
        *_core.filter_shadows(gbuffer, shadows.shadowed, shadows.weight, shadows.area, settings, scene_radius), left_out
    )


def kornia(gbuffer: GBuffer, shadows: ShadowSamples, params: Params, scene_radius: float) -> FilteredShadows:
    pytest.importorskip("kornia")
    return filters.filter_shadows(gbuffer, shadows, params, scene_radius)


def pixels(values):
    return np.ascontiguousarray(values, dtype=np.float32)


def gbuffer_of(position, normal, depth, pixel_angle=0.01) -> GBuffer:
    position, normal = pixels(position), pixels(normal)
    nothing = np.zeros_like(position)
    return GBuffer(position, normal, normal, nothing, nothing, pixels(depth), pixel_angle)


def shadows_of(shadowed, weight, area=None, left_out=None) -> ShadowSamples:
    height, width = shadowed.shape[:2]
    none = np.zeros((height, width, 0))
    area = np.zeros((height, width, 3)) if area is None else area
    return ShadowSamples(
        point=pixels(np.zeros((height, width, 0, 3))),
        member=none.astype(np.int32),
        omega=pixels(none),
        visible=none.astype(np.uint8),
        shadowed=pixels(shadowed),
        weight=pixels(weight),
        direct=pixels(np.zeros((height, width, 3))),
        area=pixels(area),
        left_out=None if left_out is None else pixels(left_out),
    )


def flat_floor(height, width) -> GBuffer:
    """A floor seen from above, one unit a pixel wide: no guide of position or normal stops much."""
    y, x = np.mgrid[:height, :width]
    position = np.stack([x, np.zeros_like(x), y], axis=2) / 100
    return gbuffer_of(position, np.broadcast_to([0.0, 1.0, 0.0], position.shape), np.ones((height, width)))


def noisy_case(height, width, channels, seed=0):
    """Rough surfaces in a 0.1 box with a fifth of background, and pixels without any picked light."""
    rng = np.random.default_rng([seed, height, width, channels])
    hit = rng.random((height, width, 1)) > 0.2
    normal = rng.normal(size=(height, width, 3)) + np.array([0, 0, 3])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    gbuffer = gbuffer_of(
        rng.random((height, width, 3)) * 0.1 * hit,
        normal * hit,
        (1 + rng.random((height, width, 1)))[..., 0] * hit[..., 0],
        0.05,
    )
    weight = rng.random((height, width, channels)) * 2 * (rng.random((height, width, 1)) < 0.8) * hit
    shadowed = weight * (rng.random((height, width, channels)) < 0.5)
    area, left_out = (rng.exponential(size=(height, width, 3)) * hit for _ in range(2))
    left_out *= rng.random((height, width, 1)) < 0.2  # few short paths meet anything: dark pixels and sparks
    return gbuffer, shadows_of(shadowed, weight, area, left_out)


def assert_alike(result: FilteredShadows, expected: FilteredShadows, atol=1e-5) -> None:
    """Equal within `atol`, of the layer's brightest value where that is above 1."""
    for name in SIGNALS:
        array, wanted = getattr(result, name), getattr(expected, name)
        if wanted is None:
            assert array is None
            continue
        assert array.dtype == np.float32 and array.flags.c_contiguous
        scale = max(1.0, np.abs(wanted).max(initial=0.0))
        np.testing.assert_allclose(array, wanted, rtol=0, atol=atol * scale, err_msg=name)
