"""One picture at any scale and place: nothing in the method has an absolute length."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import lab
from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import Frame, Lights
from lab.scene.scene import Camera, Material, Mesh, PointLight, Scene, SunLight

from ..oracle_geometry.scenes import box, occluded_room, quad, scene_of, wall_lights

SIZE = (32, 18)
# No uniform that carries the rounding of every light before; no member tables, whose slots rounding rearranges.
PARAMS = Params(vpls=2000, picker="race", shadow_points="jitter")
EYE, TARGET = np.array([1.6, 1.2, 1.8]), np.array([-0.3, 0.8, -0.4])


def moved(mesh: Mesh, scale: float, shift: Any) -> Mesh:
    position = mesh.position.astype(np.float64) * scale + shift
    return dataclasses.replace(mesh, position=position.astype(np.float32))


def sunny(scale: float = 1.0, shift: Any = 0.0) -> tuple[Scene, Camera]:
    """The room without a roof, under the sun, with a lamp; `scale` and `shift` place all of it."""
    room = occluded_room()
    floor = quad((-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2))
    wall = quad((-2, 0, -2), (2, 0, -2), (2, 2, -2), (-2, 2, -2))
    lamp = quad((-0.5, 1.9, -0.5), (0.5, 1.9, -0.5), (0.5, 1.9, 0.5), (-0.5, 1.9, 0.5), 3)
    meshes = [moved(mesh, scale, shift) for mesh in (floor, wall, *room.meshes[1:], lamp)]
    materials = [*room.materials, Material("lamp", emission=(4.0, 3.0, 2.0))]
    # A point light's irradiance falls with the square of the scale, the sun's and the lamp's radiance do not.
    point = PointLight(tuple(np.array([0.9, 1.7, 0.9]) * scale + shift), tuple(scale**2 * np.array([1.0, 2.0, 3.0])))
    scene = scene_of(meshes, materials, suns=[SunLight((0.4, 1.0, 0.6), (3.0, 2.0, 1.0))], points=[point])
    return scene, Camera("c", tuple(EYE * scale + shift), tuple(TARGET * scale + shift), fov_y_deg=80.0)


def render(scene: Scene, camera: Camera, params: Params = PARAMS) -> Frame:
    return lab.render(scene, params, camera=camera, size=SIZE)


REFERENCE = render(*sunny())


def same_picture(found: Frame, wanted: Frame, tolerance: float, share: float = 0.03) -> None:
    """Each layer within `tolerance` in all but a `share` of the pixels, and the same energy."""
    assert np.isfinite(found.image.colour).all()
    for name in ("direct", "unshadowed", "indirect", "colour", "shadow_ratio"):
        a, b = getattr(found.image, name).astype(np.float64), getattr(wanted.image, name).astype(np.float64)
        off = (np.abs(a - b) > tolerance * (b + 0.1 * b.mean())).any(axis=-1)
        assert off.mean() <= share, f"{name}: {off.mean():.3f} of the pixels differ"
        assert np.isclose(a.mean(), b.mean(), rtol=tolerance), name


@pytest.mark.parametrize("scale", [1e-3, 2.0**-10, 37.0, 1e6])
def test_scale(scale: float) -> None:
    """Sizes times s, point lights times s^2: the same picture, pixel by pixel up to rounding."""
    f = render(*sunny(scale))
    same_picture(f, REFERENCE, 0.02)
    assert np.allclose(f.hierarchy.cell_size, REFERENCE.hierarchy.cell_size * scale, rtol=1e-4)
    hit = REFERENCE.gbuffer.depth > 0
    assert np.allclose(f.gbuffer.depth[hit], REFERENCE.gbuffer.depth[hit] * scale, rtol=1e-4)
    if scale == 2.0**-10:  # a power of two rounds nothing: the same bits
        assert np.array_equal(f.image.unshadowed, REFERENCE.image.unshadowed)
        assert np.array_equal(f.lighting.light, REFERENCE.lighting.light)


@pytest.mark.parametrize("scale", [1e-3, 1e6])
@pytest.mark.parametrize("name", ["paper", "demo"])
def test_scale_of_the_presets(name: str, scale: float) -> None:
    params = lab.preset(name, vpls=1000, picker="race")
    same_picture(render(*sunny(scale), params), render(*sunny(), params), 0.02)


@pytest.mark.parametrize("scale", [1e-3, 1e6])
def test_scale_of_a_light_list(scale: float) -> None:
    """Fluxes times s^2 with lengths times s: the same irradiance."""
    lights = wall_lights(3, 60)
    frames = []
    for s in (1.0, scale):
        room = occluded_room(Lights(lights.position * np.float32(s), lights.flux * np.float32(s * s), lights.normal))
        room = dataclasses.replace(room, meshes=[moved(mesh, s, 0.0) for mesh in room.meshes])
        frames.append(render(room, Camera("c", tuple(EYE * s), tuple(TARGET * s), fov_y_deg=80.0)))
    same_picture(frames[1], frames[0], 0.02)


@pytest.mark.parametrize("shift", [10.0, -300.0])
def test_place(shift: float) -> None:
    """Some hundred sizes away from the origin, rounding moves single rays; the picture stays."""
    same_picture(render(*sunny(1.0, shift)), REFERENCE, 0.05, 0.06)


def lit_plane(shift: Any) -> tuple[Scene, Camera]:
    """A plane of unit size with a low block at its side, sun from above."""
    plane = quad((-0.5, 0, 0.5), (0.5, 0, 0.5), (0.5, 0, -0.5), (-0.5, 0, -0.5))
    meshes = [moved(mesh, 1.0, shift) for mesh in (plane, box((-0.5, 0, -0.5), (-0.3, 0.25, -0.3)))]
    eye, target = np.array([0.1, 1.2, 0.6]) + shift, np.array([0.05, 0.0, 0.0]) + shift
    scene = scene_of(meshes, suns=[SunLight((0.2, 1.0, 0.3), (1.0, 1.0, 1.0))])
    return scene, Camera("c", tuple(eye), tuple(target), fov_y_deg=40.0)


@pytest.mark.parametrize("shift", [(1e5, 0.0, 0.0), (0.0, 1e5, 0.0), (1e5, 1e5, -1e5), (0.0, 0.0, -1e5)])
def test_far_away_there_is_no_acne(shift: Any) -> None:
    """A unit scene 1e5 from the origin has coordinates 1/128 apart: rough, but a lit plane stays lit."""
    f = render(*lit_plane(np.array(shift)))
    assert np.isfinite(f.image.colour).all()
    near = render(*lit_plane(np.zeros(3)))
    floor = (f.gbuffer.normal[..., 1] > 0.9) & (near.gbuffer.normal[..., 1] > 0.9)
    # Away from the block and its shadow, where nothing stands between the plane and the sun.
    open_floor = floor & (near.gbuffer.position[..., 0] > -0.1) & (near.gbuffer.position[..., 1] < 0.01)
    assert open_floor.mean() > 0.2
    assert (near.image.direct[open_floor] > 0).all()
    assert (f.image.direct[open_floor] <= 0).any(axis=-1).mean() < 0.01
    assert np.allclose(f.image.direct[open_floor], near.image.direct[open_floor], rtol=0.02)


@pytest.mark.parametrize("shift", [(1e5, 0.0, 0.0), (1e5, 1e5, -1e5)])
def test_far_away_indirect_light_has_its_energy(shift: Any) -> None:
    f, near = render(*sunny(1.0, np.array(shift))), REFERENCE
    assert np.isfinite(f.image.colour).all()
    assert np.isclose(f.image.colour.mean(), near.image.colour.mean(), rtol=0.2)
    assert np.isclose(f.image.unshadowed.mean(), near.image.unshadowed.mean(), rtol=0.2)


def test_degenerate_triangles_change_nothing() -> None:
    """Points, needles and repeated corners, emissive ones too, among and before the others."""
    scene, camera = sunny()
    rng = np.random.default_rng(6)
    corner = rng.uniform((-1.9, 0.1, -1.9), (1.5, 1.5, 1.5), (40, 1, 3))
    position = corner + np.arange(3)[:, None] * rng.uniform(0, 0.2, (40, 1, 3))  # collinear, up to rounding
    position[:10] = corner[:10]  # or all three in one point
    position[10:20, 2] = position[10:20, 1]  # or two
    position[20:30] = corner[20:30] + np.arange(3)[:, None] * np.array([0, 0, 0.125])  # or exactly collinear
    bad = Mesh(position.reshape(-1, 3).astype(np.float32), np.arange(120, dtype=np.uint32).reshape(-1, 3), 3)
    repeated = Mesh(scene.meshes[0].position, np.uint32([[0, 0, 0], [1, 1, 2], [3, 0, 3]]), 0)
    f = render(dataclasses.replace(scene, meshes=[bad, repeated, *scene.meshes, bad]), camera)
    assert np.array_equal(f.gbuffer.position, REFERENCE.gbuffer.position)
    same_picture(f, REFERENCE, 0.02)
    assert (np.linalg.norm(f.lights.normal, axis=1) > 0.9).all()


def test_a_scene_of_nothing_but_degenerate_triangles() -> None:
    flat = Mesh(np.float32([[0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.uint32([[0, 1, 2]]))
    camera = Camera("c", (0.5, 1.0, 1.0), (0.5, 0.0, 0.0))
    with pytest.raises(lab.LabError, match="reach"):
        render(scene_of([flat], suns=[SunLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0))]), camera)
    lights = Lights(np.float32([[0.5, 1, 0]]), np.float32([[1, 1, 1]]))
    f = render(scene_of([flat], light_list=lights), camera)
    assert not f.image.indirect.any() and np.isfinite(f.image.colour).all()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_one_light_and_lights_in_one_point(scale: float, shift: float) -> None:
    """Lights in one point add up to one light, at any scale and place."""
    place = np.array([shift, 0.0, -shift]) * scale
    room = [moved(mesh, scale, place) for mesh in occluded_room().meshes]
    camera = Camera("c", tuple(EYE * scale + place), tuple(TARGET * scale + place), fov_y_deg=80.0)
    at = (np.array([1.2, 1.5, 1.2]) * scale + place).astype(np.float32)
    images = []
    for count in (1, 50):
        lights = Lights(np.tile(at, (count, 1)), np.full((count, 3), scale**2 / count, np.float32))
        scene = dataclasses.replace(occluded_room(lights), meshes=room)
        f = render(scene, camera, Params(filter="none"))
        assert np.isfinite(f.image.colour).all()
        images.append(f.image)
    assert images[0].unshadowed.max() > 0
    assert np.allclose(images[0].unshadowed, images[1].unshadowed, rtol=1e-3, atol=1e-6 * images[0].unshadowed.max())
    assert (np.abs(images[0].indirect - images[1].indirect) > 1e-3 * images[0].indirect.max()).mean() < 0.01
    assert np.isclose(CpuEngine(scene).scene_radius, 3 * scale, rtol=1e-2)
