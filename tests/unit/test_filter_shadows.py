"""Stage filter_shadows: the fused kernels and the kornia backend against plain float64 numpy."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable

import numpy as np
import pytest

from lab import _core, filters
from lab.errors import LabError
from lab.params import Params
from lab.records import FilteredShadows, GBuffer, ShadowSamples

from ..oracle.filters import oracle
from .filter_cases import SIGNALS, assert_alike, flat_floor, fused, gbuffer_of, kornia, noisy_case, shadows_of

Filter = Callable[[GBuffer, ShadowSamples, Params, float], FilteredShadows]
SIZES = [(1, 1), (2, 3), (5, 7), (16, 16), (50, 37)]
FILTERS = ["atrous_variance", "atrous", "atrous_plane", "bilateral"]
OFF = {"sigma_shadow": "none", "sigma_deviation": "none"}  # differences of the ratio stop nothing
WIDE = {**OFF, "sigma_normal": "none", "sigma_position": "none", "sigma_plane": "none"}
TIGHT = {"sigma_shadow": 0.2, "sigma_deviation": 0.5, "sigma_normal": 0.15, "sigma_position": 0.01, "sigma_plane": 0.5}


@pytest.fixture(params=[fused, kornia], ids=["fused", "kornia"])
def filter_shadows(request) -> Filter:
    return request.param


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("name", FILTERS)
def test_equals_float64(filter_shadows, name, size, channels):
    gbuffer, shadows = noisy_case(*size, channels)
    params = Params(filter=name)
    assert_alike(filter_shadows(gbuffer, shadows, params, 2.0), oracle(gbuffer, shadows, params, 2.0))


@pytest.mark.parametrize("sigmas", [TIGHT, WIDE, {**TIGHT, **OFF}], ids=["tight", "wide", "mixed"])
@pytest.mark.parametrize("name", FILTERS)
def test_equals_float64_for_other_sigmas(filter_shadows, name, sigmas):
    gbuffer, shadows = noisy_case(23, 40, 1, seed=1)
    params = Params(filter=name, **sigmas)
    assert_alike(filter_shadows(gbuffer, shadows, params, 0.7), oracle(gbuffer, shadows, params, 0.7))


def test_a_wide_row_is_filtered_in_one_piece(filter_shadows):
    """Rows are worked on in pieces inside the kernel, the bilateral of kornia in tiles: no seams may show."""
    gbuffer, shadows = noisy_case(3, 700, 1, seed=2)
    for name in FILTERS:
        params = Params(filter=name)
        assert_alike(filter_shadows(gbuffer, shadows, params, 2.0), oracle(gbuffer, shadows, params, 2.0))


def test_edge_stopping_weight_is_a_gaussian_of_the_distance():
    """Two pixels: the 3 even taps across read the pixel itself, the 2 odd ones the other, weighted exp(-d^2/2)."""
    taps = np.exp(-0.5 * np.arange(-2, 3) ** 2)
    for distance in np.linspace(0.0, 9.0, 181):
        gbuffer = gbuffer_of([[[0, 0, 0], [distance, 0, 0]]], np.zeros((1, 2, 3)), np.ones((1, 2)))
        shadows = shadows_of(np.array([[[0.0], [1.0]]]), np.ones((1, 2, 1)))
        params = Params(filter="atrous", sigma_shadow="none", sigma_normal="none", sigma_position=1.0)
        result = fused(gbuffer, shadows, params, 1.0).shadowed[0, 0, 0]
        other = taps[1::2].sum() * math.exp(-0.5 * np.float32(distance) ** 2)
        assert result == pytest.approx(other / (taps[::2].sum() + other), rel=2e-6)


@pytest.mark.parametrize("name", FILTERS)
def test_constant_signal_stays(filter_shadows, name):
    gbuffer, _ = noisy_case(19, 33, 1, seed=3)
    constant = shadows_of(np.full((19, 33, 1), 0.3), np.full((19, 33, 1), 0.7))
    result = filter_shadows(gbuffer, constant, Params(filter=name), 1.0)
    tolerance = 0 if filter_shadows is fused else 1e-6
    np.testing.assert_allclose(result.shadowed, np.float32(0.3), rtol=tolerance)
    np.testing.assert_allclose(result.weight, np.float32(0.7), rtol=tolerance)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("name", FILTERS)
def test_numerator_and_weight_share_their_tap_weights(filter_shadows, name, channels):
    gbuffer, noisy = noisy_case(21, 18, channels, seed=4)
    result = filter_shadows(gbuffer, shadows_of(noisy.weight, 2 * noisy.weight), Params(filter=name), 1.0)
    np.testing.assert_array_equal(result.weight, 2 * result.shadowed)


@pytest.mark.parametrize("name", FILTERS)
def test_pixel_without_samples_takes_its_neighbours_ratio(filter_shadows, name):
    weight = np.where(np.arange(81) == 40, 0.0, 1.0).reshape(9, 9, 1)
    result = filter_shadows(flat_floor(9, 9), shadows_of(0.25 * weight, weight), Params(filter=name), 1.0)
    assert result.weight[4, 4, 0] > 0.1
    np.testing.assert_allclose(result.shadowed / result.weight, 0.25, rtol=1e-5)


@pytest.mark.parametrize("name", FILTERS)
def test_scale_of_the_scene_does_not_matter(filter_shadows, name):
    gbuffer, shadows = noisy_case(20, 31, 1, seed=5)
    params = Params(filter=name)
    small = filter_shadows(gbuffer, shadows, params, 2.0)
    scaled = gbuffer_of(gbuffer.position * 1000, gbuffer.normal, gbuffer.depth * 1000, gbuffer.pixel_angle)
    assert_alike(filter_shadows(scaled, shadows, params, 2000.0), small)


@pytest.mark.parametrize("name", FILTERS)
def test_place_of_the_scene_does_not_matter(filter_shadows, name):
    """Far from the origin only the input itself may lose digits: with positions that lose none, nothing changes."""
    gbuffer, shadows = noisy_case(12, 12, 1, seed=6)
    near = np.round(gbuffer.position * 1024) / 1024
    params = Params(filter=name)
    results = [
        filter_shadows(gbuffer_of(position, gbuffer.normal, np.ones((12, 12)), 0.05), shadows, params, 1.0)
        for position in (near, near + 2.0**13)
    ]
    assert_alike(results[1], results[0], atol=1e-6)


@pytest.mark.parametrize("name", FILTERS)
def test_strength_of_area_lights_does_not_matter(filter_shadows, name):
    gbuffer, shadows = noisy_case(15, 15, 1, seed=7)
    params = Params(filter=name)
    weak = filter_shadows(gbuffer, shadows, params, 2.0).area
    strong = shadows_of(shadows.shadowed, shadows.weight, shadows.area * 1e6)
    np.testing.assert_allclose(filter_shadows(gbuffer, strong, params, 2.0).area, weak * 1e6, rtol=1e-4)


@pytest.mark.parametrize("name", FILTERS)
def test_background_does_not_darken_silhouettes(filter_shadows, name):
    gbuffer = flat_floor(20, 20)
    hit = np.broadcast_to(np.arange(20)[:, None] < 11, (20, 20, 1)).astype(float)
    gbuffer = gbuffer_of(gbuffer.position * hit, gbuffer.normal * hit, hit[..., 0])
    result = filter_shadows(gbuffer, shadows_of(0.5 * hit, hit, 3 * hit * np.ones(3)), Params(filter=name, **WIDE), 1.0)
    np.testing.assert_allclose(result.area, 3 * hit * np.ones(3), rtol=1e-5)
    np.testing.assert_allclose((result.shadowed / np.maximum(result.weight, 1e-20))[:, :11], 0.5, rtol=1e-5)


@pytest.mark.parametrize("name", FILTERS)
def test_edges_of_the_geometry_stop_the_filter(filter_shadows, name):
    """A lit floor and a dark wall that meet: each keeps its own ratio."""
    gbuffer = flat_floor(24, 24)
    normal = gbuffer.normal.copy()
    normal[:, 12:] = [1, 0, 0]
    lit = np.broadcast_to(np.arange(24)[:, None] < 12, (24, 24, 1)).astype(float)
    gbuffer = gbuffer_of(gbuffer.position, normal, gbuffer.depth)
    result = filter_shadows(gbuffer, shadows_of(lit, np.ones_like(lit)), Params(filter=name, sigma_normal=0.2), 1.0)
    np.testing.assert_allclose(result.shadowed, lit, atol=1e-5)


@pytest.mark.parametrize("name", FILTERS)
def test_noise_goes_and_the_mean_stays(filter_shadows, name):
    rng = np.random.default_rng(8)
    noisy = shadows_of((rng.random((64, 64, 1)) < 0.4) * 1.0, np.ones((64, 64, 1)))
    params = Params(filter=name, **OFF, sigma_position=1.0)
    ratio = filter_shadows(flat_floor(64, 64), noisy, params, 1.0).shadowed
    assert ratio.std() < 0.15 * noisy.shadowed.std()
    assert ratio.mean() == pytest.approx(noisy.shadowed.mean(), abs=0.02)


def test_none_passes_through(filter_shadows):
    gbuffer, shadows = noisy_case(6, 9, 3, seed=9)
    result = filter_shadows(gbuffer, shadows, Params(filter="none"), 1.0)
    for name in SIGNALS:
        np.testing.assert_array_equal(getattr(result, name), getattr(shadows, name))
        assert not np.shares_memory(getattr(result, name), getattr(shadows, name))


@pytest.mark.parametrize("name", FILTERS)
def test_a_picture_of_background_only_stays_empty(filter_shadows, name):
    empty = gbuffer_of(np.zeros((8, 5, 3)), np.zeros((8, 5, 3)), np.zeros((8, 5)))
    result = filter_shadows(empty, shadows_of(np.zeros((8, 5, 1)), np.zeros((8, 5, 1))), Params(filter=name), 1.0)
    assert not (result.shadowed.any() or result.weight.any() or result.area.any())


@pytest.mark.parametrize("name", FILTERS)
def test_any_number_of_threads_gives_the_same_bits(name):
    gbuffer, shadows = noisy_case(61, 300, 1, seed=10)
    results = []
    try:
        for threads in (1, 2, 5):
            _core.set_threads(threads)
            results.append(fused(gbuffer, shadows, Params(filter=name), 1.0))
    finally:
        _core.set_threads(2)
    for other in results[1:]:
        for signal in SIGNALS:
            np.testing.assert_array_equal(getattr(other, signal), getattr(results[0], signal))


def test_wrong_shapes_and_types_raise():
    gbuffer, shadows = noisy_case(4, 6, 1)
    shadowed, weight, area = shadows.shadowed, shadows.weight, shadows.area
    core = Params().to_core()
    for bad in (
        (shadowed.astype(np.float64), weight, area),
        (shadowed[:, :, 0].copy(), weight, area),
        (shadowed[:3].copy(), weight, area),
        (shadowed, weight[:, :5].copy(), area),
        (shadowed, weight, area[..., :2].copy()),
        (np.repeat(shadowed, 2, axis=2), np.repeat(weight, 2, axis=2), area),
        (np.asfortranarray(np.repeat(shadowed, 3, axis=2)), np.repeat(weight, 3, axis=2), area),
    ):
        with pytest.raises(TypeError):
            _core.filter_shadows(gbuffer, *bad, core, 1.0)


@pytest.mark.parametrize("missing", ["torch", "kornia.filters"])
def test_missing_kornia_says_how_to_get_it(monkeypatch, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    gbuffer, shadows = noisy_case(2, 2, 1)
    with pytest.raises(LabError, match="make setup EXTRA=kornia"):
        filters.filter_shadows(gbuffer, shadows, Params(), 1.0)
