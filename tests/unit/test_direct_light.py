"""Direct light, traced in stage trace_shadow_rays: sun, point and spot against float64, lamps against closed forms."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import GBuffer, ShadowSamples
from lab.scene.scene import Camera, Material, PointLight, Scene, SpotLight, SunLight

from ..oracle_geometry.direct import form_factor, lit
from ..oracle_geometry.scenes import box, occluded_room, points_as_gbuffer, quad, scene_of, tilted, wall_lights
from ..oracle_geometry.statistics import accept, z_test

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SUN = SunLight((0.5, 1.0, 0.3), (3.0, 2.0, 1.0))
POINT = PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 4.0))
SPOT = SpotLight((0.0, 1.9, 1.0), (-0.2, -1.0, -0.6), (5.0, 6.0, 7.0), 0.3, 0.9)
HARD_SPOT = SpotLight((1.5, 0.2, -1.5), (-3.0, 0.5, 3.0), (5.0, 6.0, 7.0), 0.3, 0.301)
ANY_LIST = wall_lights(1, 4)  # a light list, so that no VPLs are traced


def directly(scene: Scene, gbuffer: GBuffer, **settings: Any) -> ShadowSamples:
    """The records of trace_shadow_rays with nothing but direct light in them."""
    engine, params = CpuEngine(scene), Params(shadow_samples=0, **settings)
    h = engine.build_hierarchy(ANY_LIST, params)
    return engine.trace_shadow_rays(h, gbuffer, engine.light(h, gbuffer, params), params)


LIGHTS: dict[str, dict[str, Any]] = {
    "sun": {"suns": [SUN]},
    "point": {"points": [POINT]},
    "spot": {"spots": [SPOT]},
    "hard spot": {"spots": [HARD_SPOT]},
    "all": {"suns": [SUN], "points": [POINT], "spots": [SPOT, HARD_SPOT]},
}


@pytest.mark.parametrize("name", LIGHTS)
def test_sun_point_and_spot(name: str) -> None:
    scene = occluded_room(ANY_LIST, **LIGHTS[name])
    if scene.suns:  # the sun needs a room without a roof
        scene = dataclasses.replace(
            scene, meshes=[quad((-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)), *scene.meshes[1:]]
        )
    g = tilted(CpuEngine(scene).render_gbuffer(CAMERA, (40, 24)))
    hit = g.depth > 0
    lifted = g.position[hit] + 2e-5 * g.geometric_normal[hit].astype(np.float64)
    wanted, sure = np.zeros((hit.sum(), 3)), np.ones(hit.sum(), bool)
    for light in [*scene.suns, *scene.points, *scene.spots]:
        arriving, known = lit(scene, light, g.position[hit], g.normal[hit], lifted, ends=1e-3)
        wanted += arriving
        sure &= known
    found = directly(scene, g)
    assert sure.mean() > 0.9
    np.testing.assert_allclose(found.direct[hit][sure], wanted[sure], rtol=3e-4, atol=3e-5 * wanted.max())
    dark = (wanted == 0).all(axis=1)
    assert dark[sure].mean() < 0.98
    if name != "all":
        assert dark[sure].mean() > 0.05
    assert not found.direct[~hit].any() and not found.area.any()


def test_direct_light_needs_no_shadow_samples_and_no_seed() -> None:
    scene = occluded_room(ANY_LIST, points=[POINT], spots=[SPOT])
    g = CpuEngine(scene).render_gbuffer(CAMERA, (16, 9))
    first = directly(scene, g).direct
    assert first.any()
    assert np.array_equal(first, directly(scene, g, seed=9, frame=4).direct)


# --- emissive triangles ------------------------------------------------------------------------------------------

RADIANCE = (3.0, 2.0, 1.0)
LAMP = np.array([(-0.5, 1.5, -0.4), (0.5, 1.5, -0.4), (0.5, 1.5, 0.4), (-0.5, 1.5, 0.4)])  # faces down


def receivers(height: float, up: float) -> tuple[Any, Any]:
    """Six points in a plane below or above the lamp, with tilted normals."""
    x = np.linspace(-1.2, 1.2, 6)
    at = np.stack([x, np.full(6, height), 0.3 * x], axis=1)
    normal = np.stack([np.linspace(-0.3, 0.3, 6), np.full(6, up), np.linspace(0.2, -0.2, 6)], axis=1)
    return at, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def area_samples(scene: Scene, at: Any, normal: Any, copies: int = 400, **settings: Any) -> Any:
    """(copies, points, 3) independent estimates of each point's irradiance from lamps."""
    g = points_as_gbuffer(np.tile(at[None], (copies, 1, 1)), np.tile(normal[None], (copies, 1, 1)))
    return directly(scene, g, **settings).area


def lamp(two_sided: bool = False, scale: float = 1.0) -> Material:
    emission = tuple(scale * c for c in RADIANCE)
    return Material("lamp", (0.0, 0.0, 0.0), emission=emission, two_sided=two_sided)  # type: ignore[arg-type]


FAR_FLOOR = quad((-9, -1, 9), (9, -1, 9), (9, -1, -9), (-9, -1, -9))


@pytest.mark.parametrize("samples", [1, 4, 64])
@pytest.mark.parametrize("two_sided", [False, True])
def test_a_rectangles_irradiance(two_sided: bool, samples: int) -> None:
    scene = scene_of([FAR_FLOOR, quad(*LAMP, 1)], [Material(), lamp(two_sided)])
    at, normal = receivers(0.2, 1.0)
    wanted = np.pi * form_factor(at, normal, LAMP)[:, None] * np.array(RADIANCE)
    found = area_samples(scene, at, normal, copies=400 if samples < 64 else 60, direct_samples=samples)
    assert accept(z_test(found[..., 0], wanted[:, 0], rounding=1e-5))
    assert not accept(z_test(found[..., 0], 1.06 * wanted[:, 0])), "the test would not see an error of 6 %"
    # The channels share their samples.
    assert np.allclose(found[..., 1] * 3, found[..., 0] * 2, rtol=1e-4)


@pytest.mark.parametrize("two_sided", [False, True])
def test_behind_a_rectangle(two_sided: bool) -> None:
    scene = scene_of([FAR_FLOOR, quad(*LAMP, 1)], [Material(), lamp(two_sided)])
    at, normal = receivers(2.5, -1.0)
    found = area_samples(scene, at, normal)
    if not two_sided:
        assert not found.any()
        return
    wanted = np.pi * form_factor(at, normal, LAMP)[:, None] * np.array(RADIANCE)
    assert accept(z_test(found[..., 0], wanted[:, 0], rounding=1e-5))


def test_several_lamps_of_other_power_and_size() -> None:
    second = LAMP * [0.3, 1, 2] + [1.5, -0.2, 0]
    third = LAMP * 0.2 + [-1.2, 1.0, 0.1]
    scene = scene_of(
        [FAR_FLOOR, quad(*LAMP, 1), quad(*second, 2), quad(*third, 3)],
        [Material(), lamp(), lamp(scale=20.0), Material("blue", emission=(0.0, 0.0, 30.0))],
    )
    at, normal = receivers(0.1, 1.0)
    first = form_factor(at, normal, LAMP) + 20 * form_factor(at, normal, second)
    wanted = np.pi * first[:, None] * np.array(RADIANCE)
    wanted[:, 2] += np.pi * 30 * form_factor(at, normal, third)
    found = area_samples(scene, at, normal, copies=800)
    assert accept(np.concatenate([z_test(found[..., c], wanted[:, c], rounding=1e-5) for c in (0, 2)]))


def test_lamps_cast_shadows() -> None:
    """A slab hides half of the lamp from a point below its edge: exactly the other half arrives."""
    at, normal = np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])
    slab = box((0.0, 0.7, -3.0), (3.0, 0.8, 3.0))
    scene = scene_of([FAR_FLOOR, quad(*LAMP, 1), slab], [Material(), lamp()])
    wanted = 0.5 * np.pi * form_factor(at, normal, LAMP)[:, None] * np.array(RADIANCE)
    found = area_samples(scene, at, normal, copies=2000)
    assert accept(z_test(found[..., 0], wanted[:, 0], rounding=1e-4))
    full = scene_of([FAR_FLOOR, quad(*LAMP, 1)], [Material(), lamp()])
    assert area_samples(full, at, normal).mean() > 1.8 * found.mean()


def test_no_direct_samples_no_area_light() -> None:
    scene = scene_of([FAR_FLOOR, quad(*LAMP, 1)], [Material(), lamp()])
    at, normal = receivers(0.2, 1.0)
    assert not area_samples(scene, at, normal, direct_samples=0).any()


def test_area_samples_differ_by_pixel_seed_and_frame() -> None:
    scene = scene_of([FAR_FLOOR, quad(*LAMP, 1)], [Material(), lamp()])
    at, normal = receivers(0.2, 1.0)
    first = area_samples(scene, at, normal, copies=8)
    assert len(np.unique(first[:, 0, 0])) == 8
    assert np.array_equal(first, area_samples(scene, at, normal, copies=8))
    for other in ({"seed": 1}, {"frame": 1}):
        assert not (area_samples(scene, at, normal, copies=8, **other) == first).all(axis=-1).any()


def test_the_lamp_itself_shows_its_emission_once() -> None:
    """A visible lamp adds its radiance by emission; as a black surface it reflects none of its own light."""
    scene = scene_of([FAR_FLOOR, quad(*LAMP, 1)], [Material(), lamp()], light_list=ANY_LIST)
    view = Camera("c", (0.0, 0.5, 0.0), (0.0, 1.5, 0.001), fov_y_deg=20.0)
    engine, params = CpuEngine(scene), Params(shadow_samples=0)
    g = engine.render_gbuffer(view, (5, 5))
    h = engine.build_hierarchy(ANY_LIST, params)
    lighting = engine.light(h, g, params)
    shadows = engine.trace_shadow_rays(h, g, lighting, params)
    image = engine.composite(g, lighting, shadows, engine.filter_shadows(g, shadows, params), params)
    assert np.allclose(image.direct, RADIANCE)
    assert math.isclose(float(g.emission[2, 2, 0]), 3.0)
