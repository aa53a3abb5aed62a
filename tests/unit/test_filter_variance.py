"""The variance-guided filter: what it is for, and what no other filter has; the rest is in test_filter_shadows."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from lab.params import Params

from ..oracle.filters import oracle, variance_of_values
from .filter_cases import assert_alike, flat_floor, fused, gbuffer_of, kornia, noisy_case, shadows_of

VARIANCE = Params(filter="atrous_variance", sigma_position=1.0)


@pytest.fixture(params=[fused, kornia], ids=["fused", "kornia"])
def filter_shadows(request):
    return request.param


def ratio_of(filtered):
    return filtered.shadowed / filtered.weight


def visibility(truth, seed):
    """Four shadow rays a pixel."""
    noisy = np.random.default_rng(seed).binomial(4, truth) / 4
    return shadows_of(noisy, np.ones_like(noisy))


# --- what it is for --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dark", [0.0, 0.05])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_dark_stays_dark_next_to_what_is_bright(dark, seed):
    """The edge of a shadow on one wall, k = 4. Measured over 8 pictures: the dark side's relMSE is 30 to 51 times lower
    than with `atrous`, the bright side's 19 to 31 times, and noise far from the edge goes down by 33 to 50."""
    size, edge = 128, 64
    truth = np.where(np.arange(size)[None, :, None] < edge, dark, 0.5) * np.ones((size, size, 1))
    noisy = visibility(truth, seed)
    found = {
        name: ratio_of(fused(flat_floor(size, size), noisy, VARIANCE.replace(filter=name), 1.0))
        for name in ("atrous", "atrous_variance")
    }

    def rel_mse(name, columns):
        return ((found[name] - truth)[:, columns] ** 2 / (truth[:, columns] ** 2 + 0.01)).mean()

    for side in (slice(edge), slice(edge, None)):
        assert rel_mse("atrous_variance", side) < rel_mse("atrous", side) / 10
    flat = np.s_[:, edge + 40 :]
    assert found["atrous_variance"][flat].std() < noisy.shadowed[flat].std() / 25
    assert found["atrous_variance"][flat].mean() == pytest.approx(noisy.shadowed[flat].mean(), rel=0.01)


@pytest.mark.parametrize(("truth", "loss"), [(0.02, 0.1), (0.1, 0.03), (0.5, 0.01), (0.9, 0.01)])
def test_little_light_is_lost_to_the_guide(truth, loss):
    """Pixels among others without any light trust them too much: where 2 % of the rays are free, 7 % of it goes."""
    noisy = visibility(np.full((128, 128, 1), truth), 1)
    found = ratio_of(fused(flat_floor(128, 128), noisy, VARIANCE, 1.0))
    assert found.mean() == pytest.approx(noisy.shadowed.mean(), rel=loss)


def test_sparks_are_spread_and_not_kept():
    """Irradiance that few samples find: smoothed, with most of its energy kept (0.87 of it here)."""
    rng = np.random.default_rng(3)
    light = (rng.random((128, 128, 1)) < 0.2) / 0.2 * rng.exponential(size=(128, 128, 1)) * np.ones(3)
    shadows = shadows_of(np.zeros((128, 128, 1)), np.ones((128, 128, 1)), light, light)
    found = fused(flat_floor(128, 128), shadows, VARIANCE, 1.0).left_out
    assert found.std() < light.std() / 10
    assert 0.8 < found.mean() / light.mean() < 1.02


def test_the_oracle_knows_the_variance_of_a_ratio():
    """Its formula, to first order in the noise, against the scatter of many ratios of independent means."""
    rng = np.random.default_rng(4)
    under = rng.uniform(0.5, 1.5, (400, 2000))
    over = under * (rng.random((400, 2000)) < 0.3)
    share = np.full((400, 2000), 1.0)
    single = variance_of_values(share, over, under)
    spread = (over.sum(axis=0) / under.sum(axis=0)).var() * 400
    assert single.mean() == pytest.approx(spread, rel=0.1)


# --- tolerance -------------------------------------------------------------------------------------------------------


def clean_edge(size):
    lit = np.broadcast_to(np.arange(size)[:, None] < size // 2, (size, size, 1)).astype(float)
    return flat_floor(size, size), shadows_of(lit, np.ones_like(lit))


def test_an_edge_without_noise_stays(filter_shadows):
    """Two pixels of it blur, where the window takes the edge for noise (0.22 at most); from the fourth on next to
    nothing arrives, where `atrous` is off by 0.4."""
    gbuffer, shadows = clean_edge(64)
    found = filter_shadows(gbuffer, shadows, VARIANCE, 1.0).shadowed
    off = np.abs(found - shadows.shadowed)
    assert off.max() < 0.3
    assert off[:, np.abs(np.arange(64) - 31.5) > 3].max() < 0.01


@pytest.mark.parametrize("tolerance", ["none", 1e9, 1e38])
def test_without_a_tolerance_geometry_guides_alone(filter_shadows, tolerance):
    """Not even noise-free values stop the filter, and the result is that of no guide by value at all."""
    gbuffer, shadows = clean_edge(64)
    found = filter_shadows(gbuffer, shadows, VARIANCE.replace(sigma_deviation=tolerance), 1.0)
    free = filter_shadows(gbuffer, shadows, VARIANCE.replace(filter="atrous", sigma_shadow="none"), 1.0)
    assert_alike(found, free, atol=2e-6)
    assert 0.2 < found.shadowed[:, 36].mean() < 0.5


def test_more_tolerance_smooths_more():
    noisy = visibility(np.full((96, 96, 1), 0.5), 5)
    left = [
        fused(flat_floor(96, 96), noisy, VARIANCE.replace(sigma_deviation=tolerance), 1.0).shadowed.std()
        for tolerance in (0.01, 0.5, 1.0, 3.0, 10.0)
    ]
    assert left == sorted(left, reverse=True) and left[0] > 4 * left[-1]


# --- where little is known -------------------------------------------------------------------------------------------


def test_a_region_without_samples_takes_the_ratio_around_it(filter_shadows):
    """Wider than every window of the guide, so that nothing is known inside but by what the passes bring."""
    weight = np.ones((48, 48, 1))
    weight[16:32, 16:32] = 0
    gbuffer, shadows = flat_floor(48, 48), shadows_of(0.25 * weight, weight)
    found = filter_shadows(gbuffer, shadows, VARIANCE, 1.0)
    assert (found.weight > 1e-3).all()
    np.testing.assert_allclose(ratio_of(found), 0.25, rtol=1e-5)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("size", [(7, 70), (70, 7), (41, 43)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_equals_float64_with_regions_without_samples(filter_shadows, size, channels):
    gbuffer, shadows = noisy_case(*size, channels, seed=6)
    gbuffer = dataclasses.replace(gbuffer, position=gbuffer.position / 10)  # surfaces more alike
    known = np.ones((*size, 1), np.float32)
    known[2 : size[0] // 2 + 1, 2 : size[1] // 2 + 1] = 0
    shadows = dataclasses.replace(shadows, shadowed=shadows.shadowed * known, weight=shadows.weight * known)
    for params in (VARIANCE, VARIANCE.replace(sigma_deviation="none"), VARIANCE.replace(sigma_normal="none")):
        assert_alike(filter_shadows(gbuffer, shadows, params, 0.05), oracle(gbuffer, shadows, params, 0.05))


def test_no_sample_anywhere(filter_shadows):
    nothing = shadows_of(np.zeros((9, 20, 1)), np.zeros((9, 20, 1)))
    found = filter_shadows(flat_floor(9, 20), nothing, VARIANCE, 1.0)
    assert not (found.shadowed.any() or found.weight.any() or found.area.any())
    assert found.left_out is None


# --- numbers of any size ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("strength", [1e-25, 1e25])
def test_strength_of_the_light_does_not_matter(filter_shadows, strength):
    """Nor for irradiance, nor for ratio_rgb, whose S and U are irradiance, too; squares of it leave float32's range."""
    gbuffer, shadows = noisy_case(20, 23, 3, seed=7)
    names = ("shadowed", "weight", "area", "left_out")
    scaled = dataclasses.replace(shadows, **{n: getattr(shadows, n) * np.float32(strength) for n in names})
    wanted, found = (filter_shadows(gbuffer, s, VARIANCE, 2.0) for s in (shadows, scaled))
    for name in names:
        again = getattr(found, name).astype(np.float64) / strength
        np.testing.assert_allclose(again, getattr(wanted, name), rtol=0, atol=1e-4, err_msg=name)


def test_bright_values_nearly_alike(filter_shadows):
    """A lamp's pool at a thousand times the rest, with noise of a thousandth: squares in float32 would drown it."""
    rng = np.random.default_rng(8)
    light = rng.uniform(0.9, 1.1, (40, 60, 3))
    light[10:14, 10:16] *= 1000 * rng.uniform(0.999, 1.001, (4, 6, 1)) / light[10:14, 10:16]
    gbuffer = flat_floor(40, 60)
    shadows = shadows_of(np.zeros((40, 60, 1)), np.ones((40, 60, 1)), light, light)
    assert_alike(filter_shadows(gbuffer, shadows, VARIANCE, 1.0), oracle(gbuffer, shadows, VARIANCE, 1.0))


def test_background_has_no_part_in_any_window(filter_shadows):
    """A silhouette: neither the variance nor the guide of the surface's pixels sees what background holds."""
    gbuffer, shadows = noisy_case(30, 30, 1, seed=9)
    position = np.zeros_like(gbuffer.position)
    normal = np.broadcast_to(np.float32([0, 0, 1]), position.shape)  # background looks like the surface
    gbuffer = gbuffer_of(position, normal, gbuffer.depth)
    background = (gbuffer.depth == 0)[..., None]
    other = dataclasses.replace(shadows, shadowed=np.where(background, np.float32(0.7), shadows.shadowed))
    results = [filter_shadows(gbuffer, s, VARIANCE, 1.0).shadowed for s in (shadows, other)]
    np.testing.assert_allclose(*(np.where(background, 0, r) for r in results), rtol=1e-6)
    assert (results[1][background] == np.float32(0.7)).all()
