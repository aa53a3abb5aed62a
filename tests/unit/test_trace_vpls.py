"""Virtual point lights: their flux against closed forms, where they lie, and that they can be had again."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from lab import _core
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.records import Lights
from lab.scene.scene import Material, Mesh, PointLight, Scene, SpotLight, SunLight

from ..oracle_geometry.scenes import box, quad, scene_of
from ..oracle_geometry.statistics import z_test

ALBEDO = np.array([0.8, 0.5, 0.2])
GREY = Material("grey", tuple(ALBEDO))
ROOM = box((-1, -1, -1), (1, 1, 1), inward=True)
INTENSITY = (1.0, 2.0, 3.0)


def vpls_of(scene: Scene, **settings: Any) -> Lights:
    return CpuEngine(scene).trace_vpls(Params(**settings))


def room(**lights: Any) -> Scene:
    """A closed cube of edge 2 around the origin."""
    return scene_of([ROOM], [GREY], **lights)


def occluded() -> Scene:
    """Several kinds of light at once, over surfaces of several colours."""
    materials = [GREY, Material("red", (0.9, 0.1, 0.1)), Material("lamp", emission=(3.0, 2.0, 1.0))]
    lamp = quad((-0.2, 0.9, -0.2), (0.2, 0.9, -0.2), (0.2, 0.9, 0.2), (-0.2, 0.9, 0.2), 2)
    return scene_of(
        [ROOM, box((-0.4, -0.5, -0.3), (0.3, -0.1, 0.3), 1), lamp],
        materials,
        points=[PointLight((0.5, 0.5, 0.5), INTENSITY)],
        spots=[SpotLight((-0.5, 0.8, 0.0), (0.0, -1.0, 0.0), (4.0, 4.0, 4.0))],
    )


@pytest.mark.parametrize("count", [1, 2, 3, 255, 256, 257, 5000])
def test_as_many_as_asked_for(count: int) -> None:
    lights = vpls_of(occluded(), vpls=count)
    assert lights.position.shape == lights.flux.shape == (count, 3)
    assert lights.normal is not None and lights.normal.shape == (count, 3)
    assert lights.paths_launched >= 1
    assert np.isfinite(lights.position).all() and np.isfinite(lights.flux).all()
    assert (lights.flux.max(axis=1) > 0).all() and (lights.flux >= 0).all()
    assert np.allclose(np.linalg.norm(lights.normal, axis=1), 1, atol=1e-5)


def equal(a: Lights, b: Lights) -> bool:
    return a.paths_launched == b.paths_launched and all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in ("position", "flux", "normal")
    )


def test_seed_decides_and_threads_and_frame_do_not() -> None:
    engine = CpuEngine(occluded())
    before = _core.info()["threads"]
    params = Params(vpls=7000)
    try:
        found = {}
        for threads in (1, 2, 3):
            _core.set_threads(threads)
            found[threads] = engine.trace_vpls(params)
    finally:
        _core.set_threads(before)
    assert equal(found[1], found[2]) and equal(found[1], found[3])
    assert equal(found[1], engine.trace_vpls(params.replace(frame=5)))
    other = engine.trace_vpls(params.replace(seed=1))
    assert not equal(found[1], other)
    assert (other.position == found[1].position).all(axis=1).mean() < 0.01


# --- flux against closed forms -----------------------------------------------------------------------------------


@pytest.mark.parametrize("bounces", [1, 2, 3, 5])
def test_point_light_in_a_closed_room(bounces: int) -> None:
    """4 pi I a (1 + a + a^2 ...): every path goes on, so nothing is left to chance."""
    scene = room(points=[PointLight((0.3, -0.2, 0.1), INTENSITY)])
    lights = vpls_of(scene, vpls=bounces * 2000, max_bounces=bounces)
    assert lights.paths_launched == 2000
    wanted = 4 * np.pi * np.array(INTENSITY) * sum(ALBEDO**b for b in range(1, bounces + 1))
    assert np.allclose(lights.flux.sum(axis=0, dtype=np.float64), wanted, rtol=2e-5)


@pytest.mark.parametrize("bounces", [1, 2, 4, 16])
def test_paths_end_at_max_bounces(bounces: int) -> None:
    """Fluxes are those of bounce 1, 2 ... max_bounces, as often each, and none beyond."""
    scene = room(points=[PointLight((0.3, -0.2, 0.1), INTENSITY)])
    lights = vpls_of(scene, vpls=bounces * 512, max_bounces=bounces)
    emitted = 4 * np.pi * np.array(INTENSITY) / lights.paths_launched
    bounce = np.log(lights.flux[:, 0] / emitted[0]) / np.log(ALBEDO[0])
    assert np.allclose(bounce, bounce.round(), atol=1e-3)
    assert np.bincount(bounce.round().astype(int)).tolist() == [0] + [512] * bounces


@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.2])
def test_sun_on_a_square(tilt: float) -> None:
    """Irradiance * area * cosine * albedo, whatever disc the rays start from; nothing bounces back to a plane."""
    square = quad((-2, 0, 3), (1, 0, 3), (1, 0, 1), (-2, 0, 1))
    sun = SunLight((math.sin(tilt), math.cos(tilt), 0.0), (3.0, 2.0, 1.0))
    lights = vpls_of(scene_of([square], [GREY], suns=[sun]), vpls=20_000, max_bounces=3)
    wanted = np.array(sun.irradiance) * 6 * math.cos(tilt) * ALBEDO
    radius = CpuEngine(scene_of([square])).scene_radius
    assert np.isclose(radius, np.hypot(3, 2) / 2, rtol=1e-5)
    hit = 6 * math.cos(tilt) / (np.pi * radius**2)
    sigma = math.sqrt((1 - hit) / 20_000)
    assert np.allclose(lights.flux.sum(axis=0, dtype=np.float64), wanted, rtol=5 * sigma)
    assert np.allclose(lights.flux, lights.flux[0], rtol=1e-6)
    assert np.isclose(len(lights) / lights.paths_launched, hit, rtol=5 * sigma)


def test_sun_from_below_and_from_far_off_axis() -> None:
    """The sun's direction matters, its own length does not."""
    square = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
    sun = SunLight((0.0, -7.0, 0.0), (1.0, 1.0, 1.0))
    lights = vpls_of(scene_of([square], [GREY], suns=[sun]), vpls=8000)
    assert lights.normal is not None
    assert np.allclose(lights.normal, [0, -1, 0]) and (lights.position[:, 1] < 0).all()
    assert np.allclose(lights.flux.sum(axis=0), 4 * ALBEDO, rtol=0.05)


@pytest.mark.parametrize(("inner", "outer"), [(0.0, math.pi / 4), (0.3, 0.5), (0.2, 0.2001), (0.0, 1.5), (1.0, 1.4)])
def test_spot_light(inner: float, outer: float) -> None:
    """Intensity integrated over its cone: full inside, a squared ramp over cosines to zero at the edge."""
    spot = SpotLight((0.2, 0.6, 0.0), (0.3, -2.0, 0.1), INTENSITY, inner, outer)
    lights = vpls_of(room(spots=[spot]), vpls=20_000, max_bounces=1)
    cosine = np.linspace(math.cos(outer), 1, 200_001)
    share = np.clip((cosine - math.cos(outer)) / (math.cos(inner) - math.cos(outer)), 0, 1) ** 2
    solid_angle = 2 * np.pi * share.mean() * (1 - math.cos(outer))
    spread = math.sqrt((share**2).mean() / share.mean() ** 2 - 1)
    wanted = np.array(INTENSITY) * solid_angle * ALBEDO
    sigma = (spread + 1e-3) / math.sqrt(20_000)
    assert np.allclose(lights.flux.sum(axis=0, dtype=np.float64), wanted, rtol=5 * sigma)
    axis = np.array(spot.direction) / np.linalg.norm(spot.direction)
    to = lights.position - np.array(spot.position)
    angle = np.arccos(np.clip((to / np.linalg.norm(to, axis=1, keepdims=True)) @ axis, -1, 1))
    assert angle.max() < outer + 1e-3
    assert angle.max() > 0.8 * outer


def lamp_room(two_sided: bool, mesh: Mesh | None = None) -> Scene:
    lamp = mesh or quad((-0.3, 0.1, 0.2), (0.3, 0.1, 0.2), (0.3, 0.1, -0.2), (-0.3, 0.1, -0.2), 1)  # faces up
    black = Material("lamp", (0.0, 0.0, 0.0), emission=INTENSITY, two_sided=two_sided)
    return scene_of([ROOM, lamp], [GREY, black])


@pytest.mark.parametrize("two_sided", [False, True])
def test_emissive_triangles(two_sided: bool) -> None:
    """pi L A on the front, twice that on both sides; light leaves to the side the triangle faces."""
    lights = vpls_of(lamp_room(two_sided), vpls=10_000, max_bounces=1)
    power = np.pi * np.array(INTENSITY) * 0.24 * (2 if two_sided else 1)
    assert np.allclose(lights.flux.sum(axis=0, dtype=np.float64), power * ALBEDO, rtol=2e-5)
    above = (lights.position[:, 1] > 0.1).mean()
    assert abs(above - 0.5) < 5 * 0.5 / 100 if two_sided else above == 1


def test_emission_is_lambertian_and_even() -> None:
    """From a tiny lamp facing up, the share that reaches the ceiling is its form factor."""
    small = quad((-1e-3, 0, 1e-3), (1e-3, 0, 1e-3), (1e-3, 0, -1e-3), (-1e-3, 0, -1e-3), 1)
    lights = vpls_of(lamp_room(False, small), vpls=20_000, max_bounces=1)
    ceiling = lights.position[:, 1] > 1 - 1e-3
    assert z_test(ceiling[:, None], [ceiling_share(1.0)])[0] > 1e-5


def ceiling_share(height: float) -> float:
    """Form factor from a point to a parallel square of edge 2 centred `height` above it."""
    a = 1 / height
    root = math.sqrt(1 + a * a)
    return 4 / (2 * math.pi) * 2 * (a / root) * math.atan(a / root)


def test_bounces_are_cosine_distributed() -> None:
    """A narrow spot lights the middle of the floor; of what bounces from there, the form factor reaches the ceiling."""
    spot = SpotLight((0.0, 0.9, 0.0), (0.0, -1.0, 0.0), INTENSITY, 0.0, 0.01)
    lights = vpls_of(room(spots=[spot]), vpls=40_000, max_bounces=2)
    second = lights.position[1::2]
    assert np.allclose(lights.position[::2], [0, -1, 0], atol=0.03)
    ceiling = second[:, 1] > 1 - 1e-3
    assert z_test(ceiling[:, None], [ceiling_share(2.0)])[0] > 1e-5
    walls = second[~ceiling]
    quarters = np.bincount((np.degrees(np.arctan2(walls[:, 2], walls[:, 0])) + 45).astype(int) // 90 % 4, minlength=4)
    assert np.allclose(quarters / len(walls), 0.25, atol=5 * math.sqrt(0.19 / len(walls)))


def test_power_is_scaled_by_the_paths_launched() -> None:
    """More VPLs share the same power; a light that mostly misses needs more paths for it."""
    square = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
    scene = scene_of([square], [GREY], points=[PointLight((0.0, 2.0, 0.0), INTENSITY)])
    square_angle = 4 * math.atan(1 / (2 * math.sqrt(6)))  # solid angle of the square, seen from the light
    # From outside, rays are aimed at the sphere around the scene (a thousandth wider, for rounding).
    cone_angle = 2 * math.pi * (1 - math.sqrt(1 - (1.001 * math.sqrt(2) / 2) ** 2))
    hit = square_angle / cone_angle
    for count in (1000, 16_000):
        lights = vpls_of(scene, vpls=count)
        sigma = 1 / math.sqrt(count)
        assert np.isclose(count / lights.paths_launched, hit, rtol=5 * sigma)
        total = lights.flux.sum(axis=0, dtype=np.float64)
        assert np.allclose(total, square_angle * np.array(INTENSITY) * ALBEDO, rtol=5 * sigma)
        assert np.allclose(lights.flux * lights.paths_launched, cone_angle * np.array(INTENSITY) * ALBEDO, rtol=1e-5)


def test_lights_are_chosen_by_power() -> None:
    """Three separate rooms of powers 1 : 2 : 5, one lit by a lamp: paths in that proportion, flux of each its own."""
    rooms = [box((x - 1, -1, -1), (x + 1, 1, 1), 0, inward=True) for x in (0, 10, 20)]
    lamp = quad((19.5, 0, 0.5), (20.5, 0, 0.5), (20.5, 0, -0.5), (19.5, 0, -0.5), 1)
    strong = 5 * 4 / 1.0  # pi L A = 5 * 4 pi
    materials = [GREY, Material("lamp", emission=(strong, strong, strong))]
    points = [PointLight((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), PointLight((10.0, 0.0, 0.0), (2.0, 2.0, 2.0))]
    lights = vpls_of(scene_of([*rooms, lamp], materials, points=points), vpls=30_000, max_bounces=1)
    which = (lights.position[:, 0] / 10).round().astype(int)
    for i, share in enumerate([1 / 8, 2 / 8, 5 / 8]):
        assert z_test((which == i)[:, None], [share])[0] > 1e-5
        power = lights.flux[which == i].sum(axis=0, dtype=np.float64)
        assert np.allclose(power, 8 * share * 4 * np.pi * ALBEDO, rtol=5 / math.sqrt(30_000 * share))


def test_a_strong_colour_counts_by_its_luminance() -> None:
    """A blue and a green light of the same energy: green is chosen more, and both keep their flux."""
    rooms = [box((x - 1, -1, -1), (x + 1, 1, 1), 0, inward=True) for x in (0, 10)]
    points = [PointLight((0.0, 0.0, 0.0), (0.0, 0.0, 4.0)), PointLight((10.0, 0.0, 0.0), (0.0, 4.0, 0.0))]
    lights = vpls_of(scene_of(rooms, [GREY], points=points), vpls=20_000, max_bounces=1)
    blue = lights.position[:, 0] < 5
    assert z_test(blue[:, None], [0.0722 / (0.0722 + 0.7152)])[0] > 1e-5
    wanted = 4 * np.pi * 4 * ALBEDO * [0, 1, 1]
    assert np.allclose(lights.flux.sum(axis=0, dtype=np.float64), wanted, rtol=5 / math.sqrt(blue.sum()))


# --- where they lie ----------------------------------------------------------------------------------------------


def test_positions_lie_just_inside_the_walls_that_their_normals_leave() -> None:
    scene = occluded()
    lights = vpls_of(scene, vpls=6000)
    radius = CpuEngine(scene).scene_radius
    assert lights.normal is not None
    on_wall = np.abs(np.abs(lights.position).max(axis=1) - 1) < 1e-3
    assert 0.5 < on_wall.mean() < 1
    gap = 1 - np.abs(lights.position[on_wall]).max(axis=1).astype(np.float64)
    assert (gap > 0).all() and (gap < 1e-4 * radius).all()
    inward = -np.sign(lights.position) * (np.abs(lights.position) > 1 - 1e-3)
    assert ((lights.normal * inward).sum(axis=1)[on_wall] > 0.999).all()
    # The others lie on the block or the lamp, just outside the block, on its facing side.
    block = ~on_wall & (lights.position[:, 1] < 0.5)
    outside = np.maximum(
        np.float32([-0.4, -0.5, -0.3]) - lights.position, lights.position - np.float32([0.3, -0.1, 0.3])
    )
    nearest = outside[block].astype(np.float64)
    assert block.sum() > 100
    assert (nearest.max(axis=1) > 0).all() and (nearest.max(axis=1) < 1e-4 * radius).all()
    axis = nearest.argmax(axis=1)
    facing = lights.normal[block][np.arange(len(axis)), axis]
    middle = np.float32([-0.05, -0.3, 0.0])
    assert (facing * np.sign(lights.position[block] - middle)[np.arange(len(axis)), axis] > 0.999).all()


@pytest.mark.parametrize("height", [0.5, -0.5])
def test_a_plane_lit_from_either_side_shines_to_that_side(height: float) -> None:
    square = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))  # faces up
    lights = vpls_of(scene_of([square], [GREY], points=[PointLight((0.0, height, 0.0), INTENSITY)]), vpls=500)
    assert lights.normal is not None
    assert (lights.normal == [0, np.sign(height), 0]).all()
    assert (np.sign(lights.position[:, 1]) == np.sign(height)).all()


@pytest.mark.parametrize("height", [0.5, -0.5])
def test_normals_are_interpolated_and_turned_to_the_arriving_side(height: float) -> None:
    square = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
    bent = np.float32([[-0.6, 0.8, 0], [0.6, 0.8, 0], [0.6, 0.8, 0], [-0.6, 0.8, 0]])
    scene = scene_of([dataclasses.replace(square, normal=bent)], [GREY], points=[PointLight((0, height, 0), INTENSITY)])
    lights = vpls_of(scene, vpls=500)
    assert lights.normal is not None
    wanted = np.stack([0.6 * lights.position[:, 0], np.full(500, 0.8), np.zeros(500)], axis=1)
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    # The square's own normal, (0, 1, 0), decides the side: what arrives from below sees the normals turned over.
    wanted *= np.sign(height)
    assert np.allclose(lights.normal, wanted, atol=1e-4)


def test_flux_carries_texture_and_vertex_colour() -> None:
    """The surface's own albedo at the very point, textures at full resolution."""
    texture = np.zeros((1, 2, 4), np.uint8)
    texture[0, 0], texture[0, 1] = (255, 0, 0, 255), (0, 0, 255, 255)
    square = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1), 0, uv=True)
    square = dataclasses.replace(square, colour=np.full((4, 3), 0.5, np.float32))
    material = Material("t", (0.8, 0.8, 0.8), texture=0)
    scene = scene_of([square], [material], textures=[texture], suns=[SunLight((0, 1, 0), (1, 1, 1))])
    lights = vpls_of(scene, vpls=2000)
    x = lights.position[:, 0].astype(np.float64)
    red = np.interp(np.abs(x), [0, 0.5, 1], [0.5, 1, 0.5])
    red = np.where(x < 0, red, 1 - red)
    per_light = np.pi * CpuEngine(scene).scene_radius ** 2 / lights.paths_launched
    assert np.allclose(lights.flux[:, 0], per_light * 0.4 * red, rtol=1e-4, atol=1e-5 * per_light)
    assert np.allclose(lights.flux[:, 2], per_light * 0.4 * (1 - red), rtol=1e-4, atol=1e-5 * per_light)


def test_light_passes_through_holes() -> None:
    hole = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1), 1)
    floor = quad((-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1))
    scene = scene_of(
        [hole, floor], [GREY, Material("hole", alpha=0.2, alpha_cutoff=0.5)], suns=[SunLight((0, 1, 0), (1, 1, 1))]
    )
    assert (vpls_of(scene, vpls=500).position[:, 1] < -0.9).all()


# --- scenes that stay dark ---------------------------------------------------------------------------------------

SQUARE = quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
BLACK = Material("black", (0.0, 0.0, 0.0))
DARK = {
    "no light": scene_of([SQUARE], [GREY]),
    "no power": scene_of([SQUARE], [GREY], points=[PointLight((0, 1, 0), (0.0, 0.0, 0.0))]),
    "turned away": scene_of([SQUARE], [GREY], spots=[SpotLight((0, 1, 0), (0, 1, 0), (1.0, 1.0, 1.0))]),
    "black surfaces": scene_of([SQUARE], [BLACK], suns=[SunLight((0, 1, 0), (1.0, 1.0, 1.0))]),
}


@pytest.mark.parametrize("kind", DARK)
def test_light_that_reaches_no_surface_is_an_error(kind: str) -> None:
    with pytest.raises(LabError, match="light") as caught:
        vpls_of(DARK[kind], vpls=100)
    assert "test" in str(caught.value)  # names the scene
    assert caught.value.__cause__ is None and caught.value.__suppress_context__


def test_a_light_list_is_used_as_it_is() -> None:
    own = Lights(np.float32([[0, 1, 0]]), np.float32([[1, 2, 3]]))
    assert vpls_of(scene_of([SQUARE], [GREY], light_list=own), vpls=100) is own
