"""Stage composite on the device: from the same records, what the CPU engine makes of them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lab.engine.vulkan.composite import composite
from lab.params import Params
from lab.records import FilteredShadows, Image

from .test_composite import BACKGROUND, ENGINE, composited, flat, random_records, records, tiled

LAYERS = ("colour", "direct", "unshadowed", "indirect", "shadow_ratio")


def assert_same_image(got: Image, want: Image) -> None:
    for name in LAYERS:
        found, wanted = getattr(got, name), getattr(want, name)
        assert found.shape == wanted.shape and found.dtype == np.float32
        np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("samples", [0, 4])
@pytest.mark.parametrize("shape", [(1, 1), (9, 14), (16, 7)])
@pytest.mark.parametrize("n", [1, 2, 8])
def test_layers_are_the_cpus(gpu: Any, shape: tuple[int, int], samples: int, channels: int, n: int) -> None:
    g, lighting, shadows, filtered = random_records(4, shape, channels)
    if channels == 3:
        filtered = dataclasses.replace(filtered, left_out=None)
    estimator = "ratio_rgb" if channels == 3 else "ratio"
    params = Params(shadow_samples=samples, shadow_estimator=estimator, interleave=n)
    want = ENGINE.composite(g, lighting, shadows, filtered, params)
    assert_same_image(composite(gpu, g, lighting, shadows, filtered, background=BACKGROUND, params=params), want)


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("size", [(37, 21), (3, 2), (1, 9)])
def test_recombined_tiles_are_the_cpus(gpu: Any, n: int, size: tuple[int, int]) -> None:
    """Tiles with lights of their own on a flat receiver with a step and a crease in it."""
    g = flat(*size)
    position, normal = g.position.copy(), g.normal.copy()
    position[:, size[0] // 2 :, 2] -= 5
    normal[size[1] // 2 :] = [0, 0.8, 0.6]
    g = dataclasses.replace(g, position=position, normal=normal)
    values = np.random.default_rng(n).uniform(0, 10, (n, n, 3))
    light = tiled(values, *size)
    lighting, shadows = records(g, light, np.zeros_like(light))
    one = np.ones((*g.depth.shape, 1), np.float32)
    filtered = FilteredShadows(one, one, np.zeros_like(light))
    got = composite(gpu, g, lighting, shadows, filtered, background=BACKGROUND, params=Params(interleave=n))
    assert_same_image(got, composited(g, light, n))
