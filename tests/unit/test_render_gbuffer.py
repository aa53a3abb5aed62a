"""Every plane of the G-buffer against float64 camera rays and surfaces."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.records import GBuffer
from lab.scene.scene import Camera, Material, Mesh, Scene

from ..oracle_geometry.scenes import box, quad, scene_of, soup
from ..oracle_geometry.textures import srgb_to_linear
from ..oracle_geometry.views import View, axes, camera_rays, look

PLANES = ("position", "normal", "geometric_normal", "albedo", "emission", "depth")


def noise(seed: int, height: int, width: int) -> Any:
    return np.random.default_rng(seed).integers(0, 256, (height, width, 4), dtype=np.uint8)


def bent(mesh: Mesh, seed: int) -> Mesh:
    """`mesh` with unit vertex normals of its own: any direction, some turned against the winding."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=mesh.position.shape)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return dataclasses.replace(mesh, normal=normal.astype(np.float32))


def coloured(mesh: Mesh, seed: int) -> Mesh:
    colour = np.random.default_rng(seed).uniform(0, 1, mesh.position.shape)
    return dataclasses.replace(mesh, colour=colour.astype(np.float32))


def gallery(shift: float = 0.0) -> Scene:
    """One of each: flat, smooth, coloured, textured (repeated, shifted, tinted), emissive from one side and both."""
    materials = [
        Material("plain", (0.7, 0.5, 0.3)),
        Material("picture", texture=0),
        Material("tinted", (0.5, 1.0, 0.25), texture=1),
        Material("lamp", (0.1, 0.1, 0.1), emission=(5.0, 4.0, 3.0)),
        Material("panel", (0.2, 0.2, 0.2), emission=(0.0, 0.5, 7.0), two_sided=True),
    ]
    picture = quad((-1.5, 0, -1), (-0.3, 0, -1), (-0.3, 1.2, -1), (-1.5, 1.2, -1), 1, uv=True)
    tinted = quad((0.2, 0.1, -0.8), (1.6, 0, -1.2), (1.5, 1.4, -1), (0.3, 1.3, -0.9), 2, uv=True)
    assert tinted.uv is not None
    tinted = dataclasses.replace(tinted, uv=tinted.uv * np.float32([2.5, -1.5]) + np.float32([-3.3, 7.1]))
    lamp = [(-0.2, 1.5, -0.5), (0.2, 1.5, -0.5), (0.2, 1.9, -0.5), (-0.2, 1.9, -0.5)]
    away = [(x + 0.6, y, z) for x, y, z in reversed(lamp)]
    meshes = [
        box((-2, -0.5, -2), (2, 2.5, 2), 0, inward=True),
        bent(box((-0.2, 0, -0.3), (0.2, 0.5, 0.1)), 4),
        coloured(soup(9, 12, size=0.2, scale=0.8), 5),
        picture,
        coloured(tinted, 6),
        quad(*lamp, 3),
        quad(*away, 3),
        quad(*[(x - 0.7, y, z) for x, y, z in lamp], 4),
        quad(*[(x - 1.3, y, z) for x, y, z in reversed(lamp)], 4),
    ]
    moved = [dataclasses.replace(m, position=m.position + np.float32(shift)) for m in meshes]
    return scene_of(moved, materials, textures=[noise(1, 8, 8), noise(2, 5, 3)])


def camera(shift: float = 0.0, **changes: Any) -> Camera:
    eye, target = np.array([0.1, 1.0, 1.9]) + shift, np.array([0.0, 0.9, 0.0]) + shift
    return dataclasses.replace(Camera("c", tuple(eye), tuple(target), fov_y_deg=75.0), **changes)


def compare(g: GBuffer, view: View, length: float, least: float = 0.9) -> None:
    """`g` equals the float64 view wherever that is sure; `length` is the size of the coordinates."""
    assert view.sure.mean() >= least
    tolerance = {"position": 4e-6 * length, "depth": 4e-6 * length, "albedo": 2e-4, "emission": 1e-6}
    for name in PLANES:
        where = view.sure & view.magnified if name == "albedo" else view.sure
        found, wanted = getattr(g, name)[where], getattr(view, name)[where]
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, wanted, rtol=2e-5, atol=tolerance.get(name, 2e-5), err_msg=name)


VIEWS = {
    "plain": camera(),
    "narrow": camera(fov_y_deg=20.0),
    "wide": camera(fov_y_deg=130.0),
    "rolled": camera(up=(1.0, 0.3, 0.2)),
    "up needs no unit length": camera(up=(0.0, 40.0, 0.0)),
    "down": camera(eye=(0.3, 2.2, 0.4), target=(0.0, 0.0, 0.0)),
    "behind": camera(eye=(0.2, 0.9, -1.8), target=(0.1, 1.0, 0.0)),
}


@pytest.mark.parametrize("name", VIEWS)
def test_planes(name: str) -> None:
    scene = gallery()
    compare(CpuEngine(scene).render_gbuffer(VIEWS[name], (48, 27)), look(scene, VIEWS[name], 48, 27), 2.5)


@pytest.mark.parametrize("size", [(1, 1), (2, 1), (1, 5), (17, 13), (64, 36), (5, 40)])
def test_sizes(size: tuple[int, int]) -> None:
    scene = gallery()
    g = CpuEngine(scene).render_gbuffer(camera(), size)
    assert g.size == size
    assert g.position.shape == (size[1], size[0], 3) and g.depth.shape == (size[1], size[0])
    compare(g, look(scene, camera(), *size), 2.5, least=0.9 if min(size) > 2 else 0.0)


def test_one_pixel_looks_along_the_axis() -> None:
    scene = scene_of([quad((-9, -9, -2), (9, -9, -2), (9, 9, -2), (-9, 9, -2))])
    g = CpuEngine(scene).render_gbuffer(Camera("c", (0.5, 0.25, 1.0), (0.5, 0.25, -1.0)), (1, 1))
    assert np.allclose(g.position[0, 0], [0.5, 0.25, -2]) and np.isclose(g.depth[0, 0], 3)


def test_the_views_cover_every_case() -> None:
    """The comparison above sees each material, both sides of the lamps, and normals turned around."""
    scene = gallery()
    views = [look(scene, c, 48, 27) for c in VIEWS.values()]
    first = np.cumsum([0, *(len(mesh.index) for mesh in scene.meshes)])
    for row in range(len(scene.meshes)):
        seen = [
            ((v.triangle >= first[row]) & (v.triangle < first[row + 1]) & v.sure & v.magnified).sum() for v in views
        ]
        assert sum(seen) >= 5, f"mesh {row}"
    lamp = [v.emission[(v.triangle >= first[5]) & (v.triangle < first[7])] for v in views]
    lit = np.concatenate([(e > 0).all(axis=-1) for e in lamp])
    assert lit.any() and not lit.all()
    panel = np.concatenate([v.emission[v.triangle >= first[7]] for v in views])
    assert (panel[:, 2] == 7).all() and len(panel) > 10
    rays = [camera_rays(view, 48, 27) for view in VIEWS.values()]
    leaning = [((v.normal * ray).sum(-1)[v.triangle >= 0] > 0.1).any() for v, ray in zip(views, rays, strict=True)]
    assert any(leaning), "an interpolated normal that leans away from the viewer"


@pytest.mark.parametrize("shift", [100.0, 1e4, -3e4])
def test_far_from_the_origin(shift: float) -> None:
    scene = gallery(shift)
    view = camera(shift)
    g = CpuEngine(scene).render_gbuffer(view, (32, 18))
    wanted = look(scene, view, 32, 18)
    at = wanted.sure & (wanted.triangle < 12) & (g.depth > 0)  # the room: its planes are known well enough
    assert at.mean() > 0.25
    step = np.spacing(np.float32(abs(shift)))
    assert (np.abs(g.position - wanted.position)[at] <= 8 * step).all()
    assert (np.abs(g.depth - wanted.depth)[at] <= 30 * step).all()
    assert (g.normal[at] == wanted.normal[at]).mean() > 0.99


def test_nothing_hit_is_all_zero() -> None:
    scene = scene_of([quad((-0.4, -0.4, 0), (0.4, -0.4, 0), (0.4, 0.4, 0), (-0.4, 0.4, 0))])
    view = Camera("c", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), fov_y_deg=60)
    g = CpuEngine(scene).render_gbuffer(view, (33, 21))
    wanted = look(scene, view, 33, 21)
    away = wanted.sure & (wanted.triangle < 0)
    assert 0.3 < away.mean() < 0.95
    for name in PLANES:
        assert not getattr(g, name)[away].any(), name
    assert (g.depth[wanted.sure & ~away] > 0).all()


def test_normals_face_the_viewer_and_have_unit_length() -> None:
    scene = gallery()
    for view in VIEWS.values():
        g = CpuEngine(scene).render_gbuffer(view, (40, 22))
        ray, hit = camera_rays(view, 40, 22), g.depth > 0
        assert ((g.geometric_normal * ray).sum(-1)[hit] <= 1e-6).all()
        # At a silhouette an interpolated normal may lean away from the viewer, never into its own surface.
        assert ((g.normal * g.geometric_normal).sum(-1)[hit] >= -1e-6).all()
        for plane in (g.normal, g.geometric_normal):
            assert np.allclose(np.linalg.norm(plane[hit], axis=-1), 1, atol=1e-5)


def test_depth_is_along_the_axis() -> None:
    """A wall that faces the camera has one depth all over, not a distance that grows to the corners."""
    scene = scene_of([quad((-50, -50, -3), (50, -50, -3), (50, 50, -3), (-50, 50, -3))])
    g = CpuEngine(scene).render_gbuffer(Camera("c", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), fov_y_deg=100.0), (30, 20))
    assert np.allclose(g.depth, 4, rtol=1e-6)


@pytest.mark.parametrize(("fov", "height"), [(45.0, 20), (90.0, 7), (120.0, 64)])
def test_pixel_angle_is_the_pitch_of_pixels(fov: float, height: int) -> None:
    scene = scene_of([quad((-50, -50, -3), (50, -50, -3), (50, 50, -3), (-50, 50, -3))])
    view = Camera("c", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), fov_y_deg=fov)
    g = CpuEngine(scene).render_gbuffer(view, (9, height))
    assert np.isclose(g.pixel_angle, 2 * np.tan(np.radians(fov) / 2) / height, rtol=1e-5)
    gaps = np.diff(g.position[..., 0], axis=1), -np.diff(g.position[..., 1], axis=0)
    for gap in gaps:
        assert np.allclose(gap, g.depth[0, 0] * g.pixel_angle, rtol=1e-3)


def test_image_is_not_mirrored() -> None:
    right, up, _ = axes(camera())
    g = CpuEngine(gallery()).render_gbuffer(camera(), (21, 13))
    assert g.position[6, -1] @ right > g.position[6, 0] @ right
    assert g.position[0, 10] @ up > g.position[-1, 10] @ up


def test_colours_multiply() -> None:
    """base colour * vertex colour * decoded texture, on a texture of one texel."""
    for texel in (0, 10, 64, 128, 255):
        picture = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0, uv=True)
        picture = dataclasses.replace(picture, colour=np.full((4, 3), 0.5, np.float32))
        material = Material(base_colour=(0.8, 0.4, 0.2), texture=0)
        texture = np.full((1, 1, 4), texel, np.uint8)
        g = CpuEngine(scene_of([picture], [material], textures=[texture])).render_gbuffer(camera(), (3, 3))
        wanted = np.array([0.8, 0.4, 0.2]) * 0.5 * srgb_to_linear(texel / 255)
        assert np.allclose(g.albedo, wanted, atol=1e-6), texel


def test_a_distant_texture_is_averaged() -> None:
    """A checker of texels far under a pixel: the mean of light, one half, not of codes, and no moire."""
    checker = np.zeros((256, 256, 4), np.uint8)
    checker[..., 3] = 255
    checker[(np.indices((256, 256)).sum(axis=0) % 2) == 0, :3] = 255
    floor = quad((-4, 0, 4), (4, 0, 4), (4, 0, -4), (-4, 0, -4), 0, uv=True)
    scene = scene_of([floor], [Material(base_colour=(1.0, 1.0, 1.0), texture=0)], textures=[checker])
    view = Camera("c", (0.0, 8.0, 0.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0))
    g = CpuEngine(scene).render_gbuffer(view, (24, 24))
    seen = g.albedo[g.depth > 0]
    assert len(seen) > 300
    assert (np.abs(seen - 0.5) < 0.02).all()
    close = Camera("c", (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0))
    assert np.ptp(CpuEngine(scene).render_gbuffer(close, (24, 24)).albedo) > 0.9


def test_masked_holes_show_what_is_behind() -> None:
    texture = np.full((2, 2, 4), 255, np.uint8)
    texture[:, 0, 3] = 0  # the left half is a hole
    front = quad((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1), 0, uv=True)
    back = quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 1)
    materials = [Material(base_colour=(1.0, 0.0, 0.0), texture=0, alpha_cutoff=0.5), Material(base_colour=(0, 1.0, 0))]
    scene = scene_of([front, back], materials, textures=[texture])
    view = Camera("c", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_y_deg=40.0)
    g = CpuEngine(scene).render_gbuffer(view, (32, 32))
    compare(g, look(scene, view, 32, 32), 3.0)
    assert np.allclose(g.depth[16, 10], 3) and np.allclose(g.albedo[16, 10], [0, 1, 0])
    assert np.allclose(g.depth[16, 22], 2) and np.allclose(g.albedo[16, 22], [1, 0, 0])
