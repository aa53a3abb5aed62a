"""Stage filter_shadows on the device: the same weights as the fused kernels of the CPU engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.engine.vulkan.filter_shadows import filter_shadows
from lab.engine.vulkan.gbuffer import device_gbuffer, gbuffer_parts
from lab.params import Params

from .filter_cases import SIGNALS, assert_alike, flat_floor, fused, noisy_case, shadows_of

RADIUS = 0.1
FILTERS = ("atrous_variance", "atrous", "atrous_plane", "bilateral")


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("shape, channels", [((37, 50), 1), ((19, 11), 3)])
def test_every_filter_is_the_cpus(gpu: Any, name: str, shape: tuple[int, int], channels: int) -> None:
    gbuffer, shadows = noisy_case(*shape, channels)
    for settings in ({}, {"sigma_normal": 1.0, "sigma_position": "none", "sigma_shadow": 0.3, "sigma_deviation": 1.0}):
        params = Params(filter=name, **settings)
        got = filter_shadows(gpu, gbuffer, shadows, params, RADIUS)
        assert_alike(got, fused(gbuffer, shadows, params, RADIUS), atol=1e-4)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (3, 2), (5, 40)])
def test_tiny_pictures_are_the_cpus(gpu: Any, name: str, shape: tuple[int, int]) -> None:
    gbuffer, shadows = noisy_case(*shape, 1)
    params = Params(filter=name)
    got = filter_shadows(gpu, gbuffer, shadows, params, RADIUS)
    assert_alike(got, fused(gbuffer, shadows, params, RADIUS), atol=1e-4)


@pytest.mark.parametrize("name", FILTERS)
def test_a_constant_stays_exact_and_darkness_dark(gpu: Any, name: str) -> None:
    gbuffer = flat_floor(20, 30)
    one = np.ones((20, 30, 1))
    got = filter_shadows(gpu, gbuffer, shadows_of(0.3 * one, 0.7 * one), Params(filter=name), RADIUS)
    assert (got.shadowed == np.float32(0.3)).all() and (got.weight == np.float32(0.7)).all()
    assert not got.area.any() and got.left_out is None


@pytest.mark.parametrize("scale", [1e-20, 1e20])
def test_light_of_any_brightness(gpu: Any, scale: float) -> None:
    gbuffer, shadows = noisy_case(24, 24, 1)
    bright = shadows_of(shadows.shadowed, shadows.weight, shadows.area * scale, shadows.left_out * scale)
    for name in ("atrous_variance", "atrous"):
        params = Params(filter=name)
        got = filter_shadows(gpu, gbuffer, bright, params, RADIUS)
        want = fused(gbuffer, bright, params, RADIUS)
        for layer in ("area", "left_out"):
            np.testing.assert_allclose(getattr(got, layer) / scale, getattr(want, layer) / scale, atol=1e-4)


def test_no_filter_hands_on_what_it_gets(gpu: Any) -> None:
    gbuffer, shadows = noisy_case(9, 13, 3)
    got = filter_shadows(gpu, gbuffer, shadows, Params(filter="none"), RADIUS)
    for name in SIGNALS:
        np.testing.assert_array_equal(getattr(got, name), getattr(shadows, name))


def test_a_gbuffer_comes_back_as_it_went(gpu: Any) -> None:
    gbuffer, _ = noisy_case(9, 13, 1)
    back = device_gbuffer(gbuffer_parts(gpu, gbuffer))
    assert back.size == gbuffer.size and back.pixel_angle == gbuffer.pixel_angle
    for name in ("position", "normal", "geometric_normal", "albedo", "emission", "depth"):
        np.testing.assert_array_equal(getattr(back, name), getattr(gbuffer, name))
