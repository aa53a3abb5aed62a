"""The core's rays against every triangle in float64, and against Embree's own Python binding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from lab.scene.scene import Material, Mesh, Scene

from ..oracle_geometry.rays import free, holes_of, nearest
from ..oracle_geometry.scenes import box, core_of, quad, scene_of, soup, triangles_of

RAYS = 600


def rays_through(scene: Scene, seed: int, count: int = RAYS) -> tuple[Any, Any, Any]:
    """Random origins, targets beyond the scene's middle, and unit directions; all float32."""
    rng = np.random.default_rng(seed)
    low, high = scene.bounds
    middle, half = (low + high) / 2, (high - low) / 2
    origin = (middle + rng.uniform(-1.2, 1.2, (count, 3)) * half).astype(np.float32)
    target = (middle + rng.uniform(-1.0, 1.0, (count, 3)) * half).astype(np.float32)
    to = target.astype(np.float64) - origin
    return origin, target, (to / np.linalg.norm(to, axis=1, keepdims=True)).astype(np.float32)


SOUPS = {
    "clutter": soup(1, 150),
    "specks": soup(2, 300, size=0.05),
    "slivers": Mesh(
        (soup(3, 150).position * np.where(np.arange(450)[:, None] % 3 == 0, [1, 0.02, 1], 1)).astype(np.float32),
        soup(3, 150).index,
    ),
    "tiny": soup(4, 150, scale=1e-4),
    "huge": soup(5, 150, scale=1e6),
    "far": soup(6, 150, shift=100.0),
    "one": soup(7, 1),
}


@pytest.mark.parametrize("name", SOUPS)
def test_nearest_hits(name: str) -> None:
    scene = scene_of([SOUPS[name]])
    triangles = triangles_of(scene)
    origin, _, direction = rays_through(scene, 11)
    t, triangle, sure, _ = nearest(triangles, origin, direction, edge=1e-4)
    found_t, found = core_of(scene).intersect(origin, direction)
    assert sure.mean() > 0.95
    assert np.array_equal(found[sure], triangle[sure])
    hit = sure & (triangle >= 0)
    assert hit.sum() > (0 if name == "one" else 50)
    extent = np.abs(triangles).max()
    # A ray that grazes a plane meets it at a place that rounding of its direction shifts along the ray.
    corner = triangles[triangle[hit]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    slope = np.abs((normal * direction[hit]).sum(1)) / np.linalg.norm(normal, axis=1)
    assert (np.abs(found_t[hit] - t[hit]) * slope < 4e-6 * extent).all()
    assert np.isinf(found_t[sure & (triangle < 0)]).all()


@pytest.mark.parametrize("name", SOUPS)
def test_visibility(name: str) -> None:
    scene = scene_of([SOUPS[name]])
    origin, target, _ = rays_through(scene, 12)
    is_free, sure = free(triangles_of(scene), origin, target, edge=1e-4)
    found = core_of(scene).visible(origin, target)
    assert sure.mean() > 0.95
    assert set(np.unique(found)) <= {0, 1}
    assert np.array_equal(found[sure].astype(bool), is_free[sure])
    assert is_free[sure].sum() > 10
    if name != "one":
        assert (~is_free[sure]).sum() > 10


@pytest.mark.parametrize("name", ["clutter", "specks", "tiny"])
def test_embreex_agrees(name: str) -> None:
    scene = scene_of([SOUPS[name]])
    mesh = SOUPS[name]
    judge = EmbreeScene()
    TriangleMesh(judge, mesh.position, mesh.index.astype(np.int32))
    origin, _, direction = rays_through(scene, 13, 3000)
    seen = judge.run(origin, direction, query="INTERSECT")
    found_t, found = core_of(scene).intersect(origin, direction)
    # One engine in robust mode, the other not: they may differ on edges only.
    assert (found != seen).mean() < 2e-3
    assert (found >= 0).sum() > 300
    # Segments of unit direction that reach just past every hit are blocked; just short of it, free.
    hit = (found >= 0) & (found == seen)
    distance = found_t[hit, None]
    core = core_of(scene)
    assert core.visible(origin[hit], origin[hit] + direction[hit] * distance * 1.01).mean() < 2e-3
    assert core.visible(origin[hit], origin[hit] + direction[hit] * distance * 0.99).mean() > 1 - 2e-3
    blocked = judge.run(origin, direction, query="OCCLUDED") == 0
    far = origin + direction * np.float32(10 * np.abs(mesh.position).max())
    assert ((core.visible(origin, far) == 0) != blocked).mean() < 2e-3


def lace(seed: int, height: int, width: int) -> np.ndarray:
    """A texture whose alpha is half holes."""
    return np.random.default_rng(seed).integers(0, 256, (height, width, 4), dtype=np.uint8)


def curtain(material: Material) -> Scene:
    """Two laced quads, one behind the other, before a solid wall; the texture repeats 2.5 times across."""
    near = quad((-1, 0, 1), (1, 0, 1), (1, 2, 1), (-1, 2, 1), 0, uv=True)
    far = quad((-1, 0, 0.5), (1, 0, 0.5), (1, 2, 0.5), (-1, 2, 0.5), 0, uv=True)
    assert near.uv is not None and far.uv is not None
    meshes = [
        Mesh(near.position, near.index, 0, uv=near.uv * 2.5 - 0.75),
        Mesh(far.position, far.index, 0, uv=far.uv * 1.5),
        box((-1, 0, -1), (1, 2, -0.8), 1),
    ]
    return scene_of(meshes, [material, Material("solid")], textures=[lace(5, 7, 12)])


CURTAINS = {
    "texture": Material(texture=0, alpha_cutoff=0.5),
    "low cutoff": Material(texture=0, alpha_cutoff=0.25),
    "factor": Material(texture=0, alpha=0.6, alpha_cutoff=0.4),
    "opaque": Material(texture=0, alpha_cutoff=0.0),
    "no texture, hole": Material(alpha=0.4, alpha_cutoff=0.5),
    "no texture, solid": Material(alpha=0.6, alpha_cutoff=0.5),
    "all hole": Material(texture=0, alpha=0.1, alpha_cutoff=0.5),
}


@pytest.mark.parametrize("kind", CURTAINS)
def test_alpha_holes(kind: str) -> None:
    scene = curtain(CURTAINS[kind])
    triangles, holes = triangles_of(scene), holes_of(scene)
    rng = np.random.default_rng(21)
    origin = rng.uniform((-0.9, 0.1, 1.2), (0.9, 1.9, 2.0), (RAYS, 3)).astype(np.float32)
    origin[::2, 2] = rng.uniform(-0.3, 0.4, len(origin[::2]))  # half of them from behind
    target = rng.uniform((-0.9, 0.1, -0.8), (0.9, 1.9, 0.3), (RAYS, 3)).astype(np.float32)
    target[::2, 2] = 1.5
    t, triangle, sure, _ = nearest(triangles, origin, target - origin, holes)
    core = core_of(scene)
    found_t, found = core.intersect(origin, target - origin)
    assert sure.mean() > 0.9
    assert np.array_equal(found[sure], triangle[sure])
    hit = sure & (triangle >= 0)
    assert np.allclose(found_t[hit], t[hit], rtol=1e-5)
    is_free, sure = free(triangles, origin, target, holes)
    assert sure.mean() > 0.9
    assert np.array_equal(core.visible(origin, target)[sure].astype(bool), is_free[sure])
    through = is_free[sure].mean()
    if "solid" in kind or kind == "opaque":
        assert through == 0
    elif "hole" in kind:
        assert through > 0.9
    else:
        assert 0.01 < through < 0.9


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 33])
def test_any_number_of_rays(count: int) -> None:
    scene = scene_of([box((-1, -1, -1), (1, 1, 1))])
    origin = np.tile(np.float32([0, 0, 5]), (count, 1))
    direction = np.tile(np.float32([0, 0, -1]), (count, 1)) + np.float32([0.01, 0.005, 0])
    if count:
        direction[-1] *= -1  # the last one of a partial packet is its own ray
    t, triangle = core_of(scene).intersect(origin, direction)
    assert t.shape == triangle.shape == (count,)
    assert np.allclose(t[: max(0, count - 1)], 4)
    if count:
        assert np.isinf(t[-1]) and triangle[-1] == -1
    assert core_of(scene).visible(origin, origin + direction).tolist() == [1] * count


def test_directions_need_no_unit_length() -> None:
    """t counts in lengths of the given direction."""
    scene = scene_of([box((-1, -1, -1), (1, 1, 1))])
    origin = np.tile(np.float32([0.1, 0.2, 5]), (3, 1))
    t, _ = core_of(scene).intersect(origin, np.float32([[0, 0, -0.1], [0, 0, -1], [0, 0, -100]]))
    assert np.allclose(t, [40, 4, 0.04])


def test_several_meshes_are_numbered_through() -> None:
    meshes = [quad((-1, 0, z), (1, 0, z), (1, 1, z), (-1, 1, z)) for z in (0.0, 1.0, 2.0)]
    origin = np.float32([[0.2, 0.1, z + 0.5] for z in (0, 1, 2)])
    _, triangle = core_of(scene_of(meshes)).intersect(origin, np.tile(np.float32([0, 0, -1]), (3, 1)))
    assert triangle.tolist() == [0, 2, 4]


@pytest.mark.parametrize("bad", ["shape", "count", "dtype"])
def test_wrong_arrays_are_refused(bad: str) -> None:
    core = core_of(scene_of([SOUPS["one"]]))
    origin = np.zeros((4, 3), np.float32)
    other = {"shape": np.zeros((4, 2), np.float32), "count": np.zeros((3, 3), np.float32), "dtype": np.zeros((4, 3))}
    with pytest.raises((TypeError, ValueError)):
        core.intersect(origin, other[bad])
    with pytest.raises((TypeError, ValueError)):
        core.visible(origin, other[bad])
