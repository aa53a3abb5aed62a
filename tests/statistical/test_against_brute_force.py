"""Maps of Welch's t-test: the renderer where it is unbiased, brute force and the path tracer must agree everywhere."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import lab
from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.reference import Budget, Reference, brute_force, path_traced
from lab.scene.scene import Camera, PointLight

from ..oracle_geometry.grids import LUMINANCE
from ..oracle_geometry.scenes import Array, occluded_room, wall_lights
from ..oracle_geometry.statistics import accept, block_means, welch_test

CAMERA = Camera("inside", (1.6, 1.2, 1.8), (-0.3, 0.6, -0.4), fov_y_deg=80.0)
SIZE, SMALL, BLOCK = (48, 32), (32, 24), 4
LISTED = CpuEngine(occluded_room(wall_lights(3, 60)))
LAMP = CpuEngine(occluded_room(points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 4.0))]))

UNBIASED: dict[str, Any] = {
    "alpha": 1e6, "first_level": 0, "shadow_estimator": "average", "filter": "none", "levels": 3, "clamp_distance": 0.3
}  # fmt: skip
"""Only input lights are drawn, each pick has the chance f / F, and V is averaged: E[E V] is the sum of f V."""


def irradiance(radiance: Array) -> Array:
    """Luminance of the (H, W, 3) irradiance that an indirect layer stands for."""
    albedo = LISTED.render_gbuffer(CAMERA, SIZE).albedo.astype(np.float64)
    return np.asarray(np.pi * radiance / albedo @ LUMINANCE)


@cache
def rendered(seeds: int, **settings: Any) -> Array:
    """(seeds, H / 4, W / 4) irradiance of as many frames, means over blocks of pixels."""
    params = Params(**UNBIASED | settings)
    frames = (
        lab.render(LISTED.scene, params.replace(seed=seed), camera=CAMERA, size=SIZE, engine=LISTED)
        for seed in range(1, seeds + 1)
    )
    return block_means(np.stack([irradiance(f.image.indirect.astype(np.float64)) for f in frames]), BLOCK)


@cache
def summed(seeds: int, spp: int, **settings: Any) -> tuple[Reference, ...]:
    """Brute force over the same lights, `spp` of them drawn a pixel (60 or more: all)."""
    params = Params(**UNBIASED | settings)
    return tuple(
        brute_force(LISTED, CAMERA, SIZE, params.replace(seed=1000 + seed), budget=Budget(spp=spp))
        for seed in range(seeds)
    )


def blocks(references: tuple[Reference, ...]) -> Array:
    return block_means(np.stack([irradiance(r.indirect) for r in references]), BLOCK)


def agree(first: Array, second: Array) -> bool:
    """Sidak over the map of p-values, one a block (and channel), and the mean of the whole picture."""
    rounding = 2e-5 * second.mean()
    whole = welch_test(first.mean(axis=(1, 2)), second.mean(axis=(1, 2)), rounding)
    return accept(welch_test(first, second, rounding)) and accept(whole)


CASES: dict[str, dict[str, Any]] = {
    "reservoir": {},
    "race": {"picker": "race"},
    "one sample": {"shadow_samples": 1},
    "softened": {"falloff": "softened"},
    "from level 1": {"first_shadow_level": 1},
}


@pytest.mark.parametrize("case", CASES)
def test_renderer_against_brute_force(case: str) -> None:
    """The exact sum, and noisy sums over a few lights drawn a pixel."""
    frames = rendered(48, **CASES[case])
    exact = summed(1, 60, **CASES[case])
    assert exact[0].exact and not exact[0].indirect_variance.any()
    assert agree(frames, blocks(exact))
    noisy = summed(32, 8, **CASES[case])
    assert not any(r.exact for r in noisy)
    assert agree(frames, blocks(noisy))
    # A block that is 10 % too bright is seen, and 1 % everywhere.
    spot = np.where(np.arange(frames[0].size).reshape(frames[0].shape) == 50, 1.1, 1.0)
    assert not agree(frames * spot, blocks(exact))
    assert not agree(1.01 * frames, blocks(exact))


BIASED: dict[str, dict[str, Any]] = {
    "alpha 1": {"alpha": 1.0},
    "levels from 1 up": {"first_level": 1},
    "even picks": {"importance": False},
    "filtered": {"filter": "atrous", "sigma_position": "none", "sigma_normal": "none"},
    "no shadows": {"shadow_samples": 0},
}


@pytest.mark.parametrize("case", BIASED)
def test_approximations_are_seen(case: str) -> None:
    """The map rejects every setting that trades truth for speed: this test could not pass by being blind."""
    assert not agree(rendered(48, **BIASED[case]), blocks(summed(1, 60)))


def calibrated(images: Array, variance: Array) -> bool:
    """Whether (n, ...) `images` spread as the (n, ...) `variance` that came with each says: a test over all pixels."""
    gap = images.var(axis=0, ddof=1) - variance.mean(axis=0)
    return accept(welch_test(gap.reshape(-1, 1), [[0.0]]))


@pytest.mark.parametrize("spp", [8, 32])
def test_brute_force_by_drawn_lights(spp: int) -> None:
    """Sums over a few drawn lights have the exact sum as their mean, in every channel, and the variance they report."""
    exact, few = summed(1, 60)[0], summed(32, spp)
    assert not any(r.exact for r in few)
    images = np.stack([r.indirect for r in few])
    for channel in range(3):
        found = block_means(images[..., channel], BLOCK)
        wanted = block_means(exact.indirect[None, ..., channel], BLOCK)
        assert agree(found, wanted)
        assert not agree(1.02 * found, wanted)
    reported = np.stack([r.indirect_variance for r in few])
    assert calibrated(images, reported)
    assert not calibrated(images, 1.3 * reported)


@pytest.mark.parametrize("lights", [10, 60])
def test_next_event_estimation_among_many_lights(lights: int) -> None:
    """One shadow ray a path, to a light chosen among few or among candidates: the sum over all lights in the mean."""
    engine = CpuEngine(occluded_room(wall_lights(3, lights)))
    exact = brute_force(engine, CAMERA, SMALL, Params(clamp_distance=0), budget=Budget(spp=60))
    assert exact.exact
    found = np.stack([
        path_traced(engine, CAMERA, SMALL, Params(seed=seed, max_bounces=1), budget=Budget(spp=16)).direct
        for seed in range(24)
    ])  # fmt: skip
    for channel in range(3):
        maps = block_means(found[..., channel], BLOCK), block_means(exact.indirect[None, ..., channel], BLOCK)
        assert agree(*maps)
        assert not agree(1.02 * maps[0], maps[1])


@pytest.mark.parametrize("spp", [2, 16])
def test_path_tracer_reports_its_variance(spp: int) -> None:
    found = [path_traced(LAMP, CAMERA, SIZE, Params(seed=s), budget=Budget(spp=spp)) for s in range(32)]
    for name in ("indirect", "colour"):
        images = np.stack([getattr(r, name) for r in found])
        reported = np.stack([getattr(r, f"{name}_variance") for r in found])
        assert calibrated(images, reported)
        assert not calibrated(images, 1.3 * reported)


@cache
def by_vpls(seeds: int, **settings: Any) -> Array:
    """(seeds, H / 4, W / 4, 3) indirect light of the lamp: brute force over VPLs, new ones for each seed."""
    params = Params(vpls=1500, max_bounces=2, **settings)
    images = [
        brute_force(LAMP, CAMERA, SMALL, params.replace(seed=500 + seed), budget=Budget(spp=48)).indirect
        for seed in range(seeds)
    ]
    return np.stack([block_means(np.stack(images)[..., c], BLOCK) for c in range(3)], axis=-1)


@cache
def by_paths(seeds: int, bounces: int) -> Array:
    params = Params(max_bounces=bounces)
    images = [
        path_traced(LAMP, CAMERA, SMALL, params.replace(seed=seed), budget=Budget(spp=48)).indirect
        for seed in range(seeds)
    ]
    return np.stack([block_means(np.stack(images)[..., c], BLOCK) for c in range(3)], axis=-1)


@pytest.mark.parametrize("falloff", ["clamped", "softened"])
def test_compensated_vpls_against_the_path_tracer(falloff: str) -> None:
    """VPLs under a wide clamp, and the short paths that bring back what it leaves out: the path tracer's light."""
    settings = {"falloff": falloff, "clamp_distance": 0.3}
    whole, paths = by_vpls(20, compensation="path", **settings), by_paths(20, 2)
    assert agree(whole, paths)
    assert not agree(by_vpls(20, **settings), paths), "without compensation light is missing"
    assert not agree(1.03 * whole, paths)
    assert not agree(whole, by_paths(20, 1))
    assert not agree(whole, by_paths(20, 3))
