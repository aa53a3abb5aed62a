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

Filter = Callable[[GBuffer, ShadowSamples, Params, float], FilteredShadows]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SIZES = [(1, 1), (2, 3), (5, 7), (16, 16), (50, 37)]
FILTERS = ["atrous", "atrous_plane", "bilateral"]
WIDE = {"sigma_shadow": "none", "sigma_normal": "none", "sigma_position": "none", "sigma_plane": "none"}
TIGHT = {"sigma_shadow": 0.2, "sigma_normal": 0.15, "sigma_position": 0.01, "sigma_plane": 0.5}


def fused(gbuffer, shadows, params, scene_radius):
    return FilteredShadows(
        *_core.filter_shadows(gbuffer, shadows.shadowed, shadows.weight, shadows.area, params.to_core(), scene_radius)
    )


def kornia(gbuffer, shadows, params, scene_radius):
    pytest.importorskip("kornia")
    return filters.filter_shadows(gbuffer, shadows, params, scene_radius)


@pytest.fixture(params=[fused, kornia], ids=["fused", "kornia"])
def filter_shadows(request) -> Filter:
    return request.param


def pixels(values):
    return np.ascontiguousarray(values, dtype=np.float32)


def gbuffer_of(position, normal, depth, pixel_angle=0.01) -> GBuffer:
    position, normal = pixels(position), pixels(normal)
    nothing = np.zeros_like(position)
    return GBuffer(position, normal, normal, nothing, nothing, pixels(depth), pixel_angle)


def shadows_of(shadowed, weight, area=None) -> ShadowSamples:
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
    return gbuffer, shadows_of(shadowed, weight, rng.exponential(size=(height, width, 3)) * hit)


# --- the oracle: every tap of every pixel by an explicit index, in float64 ------------------------------------------


def tap_table(length, step, radius):
    """(length, 2 radius + 1): the pixels read by each pixel's taps; np.pad does the reflection of each sub-image."""
    table = np.empty((length, 2 * radius + 1), int)
    for residue in range(min(step, length)):
        members = np.arange(residue, length, step)
        mode = "reflect" if len(members) > 1 else "edge"
        padded = np.pad(members, radius, mode=mode)
        for i, pixel in enumerate(members):
            table[pixel] = padded[i : i + 2 * radius + 1]
    return table


def one_over(sigma):
    return 0.0 if sigma == "none" else 1 / sigma


def oracle_pass(gbuffer, params, scene_radius, numerator, denominator, value, step):
    kind = params.filter
    radius, sigma = (8, 4.0) if kind == "bilateral" else (2, 1.0)
    b3 = {-2: 1, -1: 4, 0: 6, 1: 4, 2: 1}
    height, width = value.shape
    rows, columns = tap_table(height, step, radius), tap_table(width, step, radius)
    position, normal = gbuffer.position.astype(float), gbuffer.normal.astype(float)
    hit = gbuffer.depth > 0
    sums = [np.zeros_like(numerator), np.zeros_like(denominator)]
    weights = np.zeros((height, width))
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            q = np.ix_(rows[:, dy + radius], columns[:, dx + radius])
            difference = (value[q] - value) * one_over(params.sigma_shadow)
            turned = np.linalg.norm(normal[q] - normal, axis=2) * one_over(params.sigma_normal)
            moved = position[q] - position
            if kind == "atrous_plane":
                space = b3[dy] * b3[dx] / 256
                footprint = np.where(hit, gbuffer.depth.astype(float) * gbuffer.pixel_angle, 1)
                off = np.sum(normal * moved, axis=2) / (footprint * step) * one_over(params.sigma_plane)
            else:
                space = math.exp(-(dx * dx + dy * dy) / (2 * sigma**2))
                off = np.linalg.norm(moved, axis=2) / scene_radius * one_over(params.sigma_position)
            weight = space * np.exp(-0.5 * (difference**2 + turned**2 + off**2))
            if kind == "atrous_plane" and (dx, dy) != (0, 0):
                weight = weight * hit * hit[q]
            weights += weight
            sums[0] += weight[..., None] * numerator[q]
            sums[1] += weight[..., None] * denominator[q]
    return sums[0] / weights[..., None], sums[1] / weights[..., None]


def oracle_signal(gbuffer, params, scene_radius, numerator, denominator, mean=0.0):
    for step in (1,) if params.filter == "bilateral" else (1, 2, 4, 8, 16):
        ratio = np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
        value = ratio @ LUMINANCE if ratio.shape[2] == 3 else ratio[..., 0]
        if mean:
            value = value / (value + mean)
        numerator, denominator = oracle_pass(gbuffer, params, scene_radius, numerator, denominator, value, step)
    return numerator, denominator


def oracle(gbuffer, shadows, params, scene_radius):
    shadowed, weight = oracle_signal(
        gbuffer, params, scene_radius, shadows.shadowed.astype(float), shadows.weight.astype(float)
    )
    hit = (gbuffer.depth > 0)[..., None]
    area = shadows.area.astype(float)
    if area.any():
        mean = (area @ LUMINANCE)[hit[..., 0]].mean()
        over, under = oracle_signal(gbuffer, params, scene_radius, area, np.repeat(hit, 3, axis=2).astype(float), mean)
        area = np.divide(over, under, out=np.zeros_like(area), where=hit)
    return FilteredShadows(shadowed, weight, area)


def assert_alike(result, expected, atol=1e-5):
    for name in ("shadowed", "weight", "area"):
        array = getattr(result, name)
        assert array.dtype == np.float32 and array.flags.c_contiguous
        np.testing.assert_allclose(array, getattr(expected, name), rtol=0, atol=atol, err_msg=name)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("name", FILTERS)
def test_equals_float64(filter_shadows, name, size, channels):
    gbuffer, shadows = noisy_case(*size, channels)
    params = Params(filter=name)
    assert_alike(filter_shadows(gbuffer, shadows, params, 2.0), oracle(gbuffer, shadows, params, 2.0))


@pytest.mark.parametrize("sigmas", [TIGHT, WIDE, {**TIGHT, "sigma_shadow": "none"}], ids=["tight", "wide", "mixed"])
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
        params = Params(sigma_shadow="none", sigma_normal="none", sigma_position=1.0)
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
    params = Params(filter=name, sigma_shadow="none", sigma_position=1.0)
    ratio = filter_shadows(flat_floor(64, 64), noisy, params, 1.0).shadowed
    assert ratio.std() < 0.15 * noisy.shadowed.std()
    assert ratio.mean() == pytest.approx(noisy.shadowed.mean(), abs=0.02)


def test_none_passes_through(filter_shadows):
    gbuffer, shadows = noisy_case(6, 9, 3, seed=9)
    result = filter_shadows(gbuffer, shadows, Params(filter="none"), 1.0)
    for name in ("shadowed", "weight", "area"):
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
        for signal in ("shadowed", "weight", "area"):
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
