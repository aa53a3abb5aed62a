"""Compositing: identities between the image's layers, and the recombination of interleaved tiles."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import FilteredShadows, GBuffer, Image, Lighting, ShadowSamples
from lab.scene.scene import SunLight

from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, scene_of, soup, wall_lights

BACKGROUND = (0.1, 0.2, 0.4)
ENGINE = CpuEngine(scene_of([soup(1, 1)], background=BACKGROUND))
LAYERS = ("colour", "direct", "unshadowed", "indirect")


def random_records(seed: int, shape: tuple[int, int], channels: int) -> tuple[Any, ...]:
    """A G-buffer with holes of background, and anything at all in the other records."""
    rng = np.random.default_rng(seed)

    def some(*more: int) -> Any:
        return rng.uniform(0.1, 2, (*shape, *more)).astype(np.float32)

    seen = rng.random(shape) < 0.8
    normal = rng.normal(size=(*shape, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    planes = [some(3), normal.astype(np.float32), normal.astype(np.float32), some(3) / 2, some(3) * (some(1) > 1.5)]
    gbuffer = GBuffer(*(np.where(seen[..., None], p, 0).astype(np.float32) for p in planes), some() * seen, 0.01)
    weight = some(channels) * (rng.random((*shape, 1)) < 0.9)
    filtered = FilteredShadows(weight * some(channels) / 2, weight.astype(np.float32), some(3), some(3))
    return gbuffer, *records(gbuffer, some(3), some(3)), filtered


def records(gbuffer: GBuffer, irradiance: Any, direct: Any) -> tuple[Lighting, ShadowSamples]:
    """The planes that compositing reads; the rest is empty."""
    h, w = gbuffer.depth.shape
    empty = np.zeros((h, w, 0), np.float32)
    counts = np.zeros((1, h, w), np.uint32)
    lighting = Lighting(irradiance, counts, counts, np.zeros((h, w, 0), np.int32), empty, np.zeros((h, w), np.float32))
    no = np.zeros((h, w, 1), np.float32)
    points, rays = np.zeros((h, w, 0, 3), np.float32), np.zeros((h, w, 0), np.uint8)
    member = np.zeros((h, w, 0), np.int32)
    return lighting, ShadowSamples(points, member, empty, rays, no, no, direct, np.zeros((h, w, 3), np.float32))


def shadow_ratio(shadowed: Any, weight: Any) -> Any:
    """S over its weight; without one, that of the smallest square around the pixel (3, 5, 9 a side) that has any."""
    ratio = np.zeros(weight.shape)
    for y, x, c in np.ndindex(*weight.shape):
        for reach in (0, 1, 2, 4):
            near = np.s_[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1, c]
            if weight[near].sum() > 0:
                ratio[y, x, c] = shadowed[near].sum(dtype=np.float64) / weight[near].sum(dtype=np.float64)
                break
    return ratio


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("samples", [0, 4])
@pytest.mark.parametrize("shape", [(1, 1), (9, 14), (16, 7)])
@pytest.mark.parametrize("compensated", [False, True])
def test_layers_add_up(shape: tuple[int, int], samples: int, channels: int, compensated: bool) -> None:
    g, lighting, shadows, filtered = random_records(4, shape, channels)
    if not compensated:
        filtered = dataclasses.replace(filtered, left_out=None)
    params = Params(shadow_samples=samples, shadow_estimator="ratio_rgb" if channels == 3 else "ratio")
    image: Image = ENGINE.composite(g, lighting, shadows, filtered, params)
    seen = g.depth > 0
    assert image.shadow_ratio.shape == (*shape, channels)
    ratio = np.ones_like(filtered.weight) if samples == 0 else shadow_ratio(filtered.shadowed, filtered.weight)
    albedo = g.albedo / np.pi
    wanted = {
        "unshadowed": lighting.irradiance,
        "indirect": (lighting.irradiance * ratio + (filtered.left_out if compensated else 0)) * albedo,
        "direct": g.emission + (shadows.direct + filtered.area) * albedo,
    }
    wanted["colour"] = wanted["direct"] + wanted["indirect"]
    assert np.allclose(image.shadow_ratio[seen], ratio[seen], rtol=1e-5)
    for name in LAYERS:
        found = getattr(image, name)
        assert found.dtype == np.float32 and np.isfinite(found).all()
        np.testing.assert_allclose(found[seen], wanted[name][seen], rtol=1e-5, atol=1e-7, err_msg=name)
        assert (found[~seen] == np.float32(BACKGROUND if name == "colour" else 0)).all()


def test_the_unfiltered_area_light_is_not_shown() -> None:
    """Compositing takes the area light's irradiance from the filter, not the noisy one from the rays."""
    g, lighting, shadows, filtered = random_records(4, (8, 8), 1)
    noisy = dataclasses.replace(shadows, area=np.full((8, 8, 3), 100, np.float32))
    one = ENGINE.composite(g, lighting, shadows, filtered, Params())
    other = ENGINE.composite(g, lighting, noisy, filtered, Params())
    assert np.array_equal(one.colour, other.colour)


@pytest.mark.parametrize("n", [1, 4])
def test_what_the_clamp_left_out_comes_back_unshadowed(n: int) -> None:
    """Short paths know their own visibility: no ratio is laid over them, and no interleaving spreads them."""
    g, lighting, shadows, filtered = random_records(4, (12, 16), 1)
    dark = dataclasses.replace(filtered, shadowed=np.zeros_like(filtered.shadowed))
    image = ENGINE.composite(g, lighting, shadows, dark, Params(interleave=n))
    seen = g.depth > 0
    assert not image.shadow_ratio.any()
    np.testing.assert_allclose(image.indirect[seen], (filtered.left_out * g.albedo / np.pi)[seen], rtol=1e-6)
    without = ENGINE.composite(g, lighting, shadows, dataclasses.replace(dark, left_out=None), Params(interleave=n))
    assert not without.indirect.any()
    for name in ("unshadowed", "direct", "shadow_ratio"):
        assert np.array_equal(getattr(image, name), getattr(without, name)), name


def test_the_unfiltered_short_paths_are_not_shown() -> None:
    g, lighting, shadows, filtered = random_records(4, (8, 8), 1)
    noisy = dataclasses.replace(shadows, left_out=np.full((8, 8, 3), 100, np.float32))
    one, other = (ENGINE.composite(g, lighting, s, filtered, Params()) for s in (shadows, noisy))
    assert np.array_equal(one.indirect, other.indirect)


def test_no_weight_never_means_full_light() -> None:
    """Where no sample near or far says anything, a ratio of 1 would leak."""
    g, lighting, shadows, filtered = random_records(4, (8, 8), 1)
    nothing = np.zeros((8, 8, 1), np.float32)
    image = ENGINE.composite(g, lighting, shadows, FilteredShadows(nothing, nothing, filtered.area), Params())
    assert not image.shadow_ratio.any() and not image.indirect.any()
    assert image.unshadowed.any()


# --- interleaving -------------------------------------------------------------------------------------------------


def flat(width: int, height: int) -> GBuffer:
    """A plane that faces the viewer."""
    y, x = np.mgrid[:height, :width]
    position = np.stack([0.01 * x, -0.01 * y, np.zeros_like(x)], axis=-1)
    return points_as_gbuffer(position, np.broadcast_to([0, 0, 1.0], position.shape))


def tiled(values: Any, width: int, height: int) -> Any:
    """Irradiance that depends on a pixel's interleaving tile alone; `values` (n, n, 3) by (y mod n, x mod n)."""
    n = len(values)
    y, x = np.mgrid[:height, :width]
    return np.ascontiguousarray(values[y % n, x % n], np.float32)


def composited(g: GBuffer, irradiance: Any, n: int) -> Image:
    lighting, shadows = records(g, irradiance, np.zeros_like(irradiance))
    one = np.ones((*g.depth.shape, 1), np.float32)
    return ENGINE.composite(
        g, lighting, shadows, FilteredShadows(one, one, np.zeros_like(irradiance)), Params(interleave=n)
    )


@pytest.mark.parametrize("n", [1, 2, 4, 8])
@pytest.mark.parametrize("size", [(32, 16), (37, 21), (8, 8), (11, 9), (64, 36)])
def test_recombination_is_exact_on_a_flat_evenly_lit_receiver(n: int, size: tuple[int, int]) -> None:
    """Each tile has its own light; every pixel, up to the corners, gets the mean over all tiles."""
    values = np.random.default_rng(n).uniform(0, 10, (n, n, 3))
    image = composited(flat(*size), tiled(values, *size), n)
    np.testing.assert_allclose(
        image.unshadowed, np.broadcast_to(values.mean(axis=(0, 1)), image.unshadowed.shape), rtol=2e-6
    )


@pytest.mark.parametrize("n", [2, 4, 8])
def test_one_tile_alone_counts_one_in_n_squared(n: int) -> None:
    """No tile is seen twice or left out: light in any single tile comes out as 1/n^2 everywhere."""
    for tile in range(n * n):
        values = np.zeros((n, n, 3))
        values[tile // n, tile % n] = n * n
        assert np.allclose(composited(flat(19, 17), tiled(values, 19, 17), n).unshadowed, 1, rtol=1e-5), tile


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("edge", ["normal", "depth"])
def test_other_surfaces_do_not_mix(n: int, edge: str) -> None:
    """A crease or a step between two evenly lit halves stays as sharp as it was."""
    g = flat(40, 24)
    position, normal = g.position.copy(), g.normal.copy()
    right = np.arange(40) >= 20
    if edge == "normal":
        normal[:, right] = [1, 0, 0]
    else:
        position[:, right, 2] -= 5
    g = dataclasses.replace(g, position=position, normal=normal, geometric_normal=normal)
    light = np.where(right[None, :, None], 1.0, 9.0) * np.ones((24, 40, 3))
    found = composited(g, np.ascontiguousarray(light, np.float32), n).unshadowed
    assert np.allclose(found, light, rtol=1e-6)


@pytest.mark.parametrize("n", [2, 4, 8])
def test_background_does_not_mix_in(n: int) -> None:
    g = flat(24, 16)
    depth = g.depth.copy()
    depth[:, 10:] = 0
    light = np.full((16, 24, 3), 3, np.float32)
    light[:, 10:] = 1000
    found = composited(dataclasses.replace(g, depth=depth), light, n)
    assert np.allclose(found.unshadowed[:, :10], 3)
    assert not found.unshadowed[:, 10:].any()


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("size", [(1, 1), (1, 9), (3, 2), (7, 7)])
def test_images_smaller_than_a_block_of_tiles(n: int, size: tuple[int, int]) -> None:
    """Not every tile has a pixel: still finite, and within the range of what there is."""
    values = np.random.default_rng(n).uniform(1, 10, (n, n, 3))
    light = tiled(values, *size)
    found = composited(flat(*size), light, n).unshadowed
    assert (found >= light.min(axis=(0, 1)) * (1 - 1e-6)).all() and (found <= light.max(axis=(0, 1)) * (1 + 1e-6)).all()


@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize("deal_all", [False, True])
def test_interleaved_light_on_one_point_is_the_whole_light(n: int, deal_all: bool) -> None:
    """End to end with a real hierarchy: a receiver that is the same in every pixel gets back the undealt sum."""
    lights = wall_lights(5, 300)
    engine = CpuEngine(occluded_room(lights, suns=[SunLight((0, 1, 0), (1, 1, 1))]))
    size = (16, 16, 1)
    g = points_as_gbuffer(np.tile([0.8, 0.0, -0.2], size), np.tile([0.0, 1.0, 0.0], size))
    images = []
    for interleave in (1, n):
        params = Params(interleave=interleave, deal_all=deal_all, shadow_samples=0)
        h = engine.build_hierarchy(lights, params)
        lighting = engine.light(h, g, params)
        shadows = engine.trace_shadow_rays(h, g, lighting, params)
        filtered = engine.filter_shadows(g, shadows, params)
        images.append(engine.composite(g, lighting, shadows, filtered, params).unshadowed)
    np.testing.assert_allclose(images[1], images[0], rtol=2e-5)
    assert np.ptp(lighting.irradiance, axis=(0, 1)).max() > 0.1 * images[0].max(), "tiles have lights of their own"
