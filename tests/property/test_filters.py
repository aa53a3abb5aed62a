"""What every filter keeps, for any input: the range of the shadow ratio, finite numbers, symmetry."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lab import _core, filters
from lab.params import Params
from lab.records import GBuffer, ShadowSamples

FILTERS = ["atrous_variance", "atrous", "atrous_plane", "bilateral"]
SIGMAS = st.one_of(st.just("none"), st.floats(0.01, 10.0), st.sampled_from([1e-30, 1e30]))


def numbers(low, high):
    return st.floats(low, high, width=32, allow_subnormal=False)


BRIGHTNESS = numbers(0, np.float32(1e30))


def image(height, width, channels, low, high):
    return arrays(np.float32, (height, width, channels), elements=numbers(np.float32(low), np.float32(high)))


@st.composite
def parameters(draw, sigma=SIGMAS):
    sigmas = {f"sigma_{name}": draw(sigma) for name in ("deviation", "shadow", "normal", "position", "plane")}
    return Params(filter=draw(st.sampled_from(FILTERS)), **sigmas)


@st.composite
def frames(draw, extent=1e30, brightest=1e30):
    """A G-buffer with positions and normals of any size, and any signals of 1 or 3 channels."""
    height, width = draw(st.integers(1, 9)), draw(st.integers(1, 12))
    channels = draw(st.sampled_from([1, 3]))
    position = draw(image(height, width, 3, -extent, extent))
    normal = draw(image(height, width, 3, -extent, extent))
    depth = draw(image(height, width, 1, 0, extent))[..., 0]
    signals = [draw(image(height, width, count, 0, brightest)) for count in (channels, channels, 3)]
    angle = draw(st.sampled_from([1e-3, 1e-20, 10.0]))
    return GBuffer(position, normal, normal, normal, normal, depth, angle), signals


def fused(gbuffer, signals, params, scene_radius=1.0):
    """Filtered S, its weight, the area lights' irradiance, and the same once more as what the clamp leaves out."""
    light = _core.filter_irradiance(gbuffer, signals[2], params.to_core(), scene_radius)
    return *_core.filter_shadows(gbuffer, *signals, params.to_core(), scene_radius), light


def kornia(gbuffer, signals, params, scene_radius=1.0):
    shadowed, weight, area = signals
    nothing = np.zeros(0)
    samples = ShadowSamples(nothing, nothing, nothing, nothing, shadowed, weight, nothing, area, area)
    result = filters.filter_shadows(gbuffer, samples, params, scene_radius)
    return result.shadowed, result.weight, result.area, result.left_out


@given(frames(), parameters(), st.sampled_from([1e-30, 1.0, 1e30]))
@settings(max_examples=150, deadline=None)
def test_finite_input_gives_finite_output(frame, params, scene_radius):
    for signal in fused(*frame, params, scene_radius):
        assert np.isfinite(signal).all() and (signal >= 0).all()


@given(frames(), parameters(), st.sampled_from([1e-30, 1.0, 1e30]))
@settings(max_examples=40, deadline=None)
def test_finite_input_gives_finite_output_on_kornia(frame, params, scene_radius):
    pytest.importorskip("kornia")
    for signal in kornia(*frame, params, scene_radius):
        assert np.isfinite(signal).all() and (signal >= 0).all()


@given(frames(extent=2.0, brightest=4.0), parameters(), st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_ratio_stays_inside_its_range(frame, params, seed):
    gbuffer, (weight, _, area) = frame
    weight = np.where(weight > 1e-3, weight, np.float32(0))
    ratio = np.random.default_rng(seed).random(weight.shape, dtype=np.float32)
    shadowed, filtered, *_ = fused(gbuffer, (ratio * weight, weight, area), params)
    for channel in range(weight.shape[2]):
        some = weight[..., channel] > 0
        if not some.any():
            assert not shadowed[..., channel].any()
            continue
        low, high = ratio[some, channel].min(), ratio[some, channel].max()
        slack = 1e-5 * filtered[..., channel] + 2e-6 * weight.max()  # float32 rounding of the sums
        assert (shadowed[..., channel] <= high * filtered[..., channel] + slack).all()
        assert (shadowed[..., channel] >= low * filtered[..., channel] - slack).all()
        assert (filtered[some, channel] > 0).all()


@given(frames(extent=2.0, brightest=4.0), parameters())
@settings(max_examples=60, deadline=None)
def test_signals_stay_inside_their_range(frame, params):
    gbuffer, signals = frame
    for before, after in zip(signals[:2], fused(gbuffer, signals, params)[:2], strict=True):
        slack = 1e-5 * before.max()
        assert (after <= before.max() + slack).all() and (after >= before.min() - slack).all()


@given(
    st.integers(1, 40),
    st.integers(1, 40),
    parameters(st.one_of(st.just("none"), st.floats(0.1, 10.0))),
    st.sampled_from(["columns", "rows", "transposed"]),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=60, deadline=None)
def test_a_mirrored_picture_gives_the_mirrored_result(height, width, params, how, seed):
    """On well-conditioned frames: tiny sigmas turn the last bit of a guide into a weight of 0 or 1."""
    rng = np.random.default_rng(seed)
    position, normal, area = (rng.random((height, width, 3), dtype=np.float32) for _ in range(3))
    depth = rng.choice(np.float32([0.0, 1.0, 1.5]), (height, width))
    signals = [rng.random((height, width, 1), dtype=np.float32) for _ in range(2)] + [area]

    def mirrored(array):
        if how == "transposed":
            return np.ascontiguousarray(np.swapaxes(array, 0, 1))
        return np.ascontiguousarray(np.flip(array, 1 if how == "columns" else 0))

    def filtered(position, normal, depth, signals):
        return fused(GBuffer(position, normal, normal, normal, normal, depth, 0.1), signals, params)

    expected = filtered(position, normal, depth, signals)
    result = filtered(*map(mirrored, (position, normal, depth)), list(map(mirrored, signals)))
    assert np.array_equal(result[2], result[3]), "irradiance is irradiance, wherever from"
    for after, before in zip(result, expected, strict=True):
        np.testing.assert_allclose(after, mirrored(before), rtol=0, atol=1e-4)


@given(frames(extent=2.0, brightest=4.0), parameters(), BRIGHTNESS, BRIGHTNESS)
@settings(max_examples=60, deadline=None)
def test_constants_stay_exactly(frame, params, over, under):
    """Sums are of differences to the pixel's own value, so not even the last bit moves."""
    gbuffer, (weight, _, _) = frame
    signals = np.full_like(weight, over), np.full_like(weight, under), np.zeros_like(gbuffer.position)
    shadowed, filtered, *_ = fused(gbuffer, signals, params)
    assert (shadowed == np.float32(over)).all() and (filtered == np.float32(under)).all()


@given(frames(extent=2.0, brightest=4.0), parameters(), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_background_is_an_island(frame, params, seed):
    """Of the filters that know background: what it holds stays there, and no surface takes any of it."""
    gbuffer, signals = frame
    params = params.replace(filter="atrous_plane" if params.filter == "atrous_plane" else "atrous_variance")
    rng = np.random.default_rng(seed)
    background = (rng.random(gbuffer.depth.shape) < 0.5)[..., None]
    gbuffer = dataclasses.replace(gbuffer, depth=np.where(background[..., 0], np.float32(0), gbuffer.depth + 1))
    before = fused(gbuffer, signals, params)
    for signal, after in zip(signals[:2], before[:2], strict=True):
        assert np.array_equal(np.where(background, signal, 0), np.where(background, after, 0))
    changed = [np.where(background, rng.random(s.shape, dtype=np.float32) * 4, s) for s in signals]
    for one, other in zip(before, fused(gbuffer, changed, params), strict=True):
        assert np.array_equal(np.where(background, 0, one), np.where(background, 0, other))


@given(frames(extent=2.0, brightest=4.0), st.sampled_from(FILTERS), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_without_a_tolerance_values_stop_nothing(frame, name, seed):
    """Only geometry weighs the taps: what happens to one signal does not depend on the other."""
    gbuffer, (shadowed, weight, area) = frame
    params = Params(filter=name, sigma_shadow="none", sigma_deviation="none")
    other = np.random.default_rng(seed).random(shadowed.shape, dtype=np.float32)
    first, second = fused(gbuffer, (shadowed, weight, area), params), fused(gbuffer, (other, weight, area), params)
    assert np.array_equal(first[1], second[1])
