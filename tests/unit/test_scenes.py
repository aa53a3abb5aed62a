"""Our own scenes: each make.py writes the committed bytes again, and what it made is sound."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lab.records import Lights
from lab.scene.load import load_scene
from lab.scene.scene import Scene

MADE = {"cornell": ["cornell.glb"], "atrium": ["atrium.glb"], "lamps": ["lamps.glb", "lamps.npz"]}


@pytest.fixture(scope="module")
def scenes(root: Path) -> dict[str, Scene]:
    return {name: load_scene(root / "scenes" / name / "scene.toml") for name in MADE}


def triangles_of(scene: Scene, *, without: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Corners (t, 3, 3) and vertex normals (t, 3, 3) of a scene, but for the material called `without`."""
    kept = [m for m in scene.meshes if scene.materials[m.material].name != without]
    corners = np.concatenate([m.position[m.index] for m in kept]).astype(np.float64)
    return corners, np.concatenate([m.normal[m.index] for m in kept]).astype(np.float64)


@pytest.mark.parametrize("name", MADE)
def test_make_writes_the_committed_bytes_again(root: Path, tmp_path: Path, name: str) -> None:
    script = root / "scenes" / name / "make.py"
    done = subprocess.run(
        [sys.executable, "-B", str(script), str(tmp_path / "new")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == MADE[name]
    for file in MADE[name]:
        assert (tmp_path / "new" / file).read_bytes() == (script.parent / file).read_bytes(), file


def test_the_committed_scenes_are_small(root: Path) -> None:
    sizes = {f: (root / "scenes" / name / f).stat().st_size for name, files in MADE.items() for f in files}
    assert sum(sizes.values()) < 8.2e6, sizes


def test_cornell_is_the_box_with_one_lamp_that_faces_down(scenes: dict[str, Scene]) -> None:
    scene = scenes["cornell"]
    low, high = scene.bounds
    assert scene.triangles == 32
    np.testing.assert_allclose(high - low, [5.56, 5.488, 5.592], atol=1e-3)
    lamps = [m for m in scene.meshes if max(scene.materials[m.material].emission) > 0]
    assert len(lamps) == 1
    assert not scene.materials[lamps[0].material].two_sided
    a, b, c = lamps[0].position[lamps[0].index[0]].astype(np.float64)
    normal = np.cross(b - a, c - a)
    np.testing.assert_allclose(normal / np.linalg.norm(normal), [0, -1, 0], atol=1e-6)
    assert max(scene.materials[lamps[0].material].emission) == pytest.approx(17.0, rel=1e-5)
    colours = {m.name: m.base_colour for m in scene.materials}
    assert colours["red"][0] > 5 * colours["red"][1] and colours["green"][1] > 2 * colours["green"][0]


def test_atrium_has_what_the_default_scene_promises(scenes: dict[str, Scene]) -> None:
    scene = scenes["atrium"]
    assert 60_000 <= scene.triangles <= 150_000
    assert [c.name for c in scene.cameras[:2]] == ["main", "gallery"]
    assert len(scene.suns) == 1 and not scene.points and not scene.spots and scene.light_list is None
    assert not any(max(m.emission) > 0 for m in scene.materials)
    elevation = np.degrees(np.arcsin(scene.suns[0].to_sun[1]))
    assert 25 < elevation < 55
    masked = {m.name for m in scene.materials if m.alpha_cutoff > 0}
    assert masked == {"leaves"}
    leaf = next(m for m in scene.materials if m.name == "leaves")
    assert set(np.unique(scene.textures[leaf.texture][..., 3])) == {0, 255}
    textured = {m.name for m in scene.materials if m.texture >= 0}
    assert {"stone", "ashlar", "paving", "tiles", "wood", "cloth"} <= textured


@pytest.mark.parametrize("name", ["atrium", "lamps"])
def test_reflectances_are_those_of_real_surfaces(scenes: dict[str, Scene], name: str) -> None:
    scene = scenes[name]
    for material in scene.materials:
        colour = np.array(material.base_colour)
        if material.texture >= 0:
            texels = scene.textures[material.texture].astype(np.float64)
            solid = texels[texels[..., 3] > 127][:, :3] / 255
            linear = np.where(solid <= 0.04045, solid / 12.92, ((solid + 0.055) / 1.055) ** 2.4)
            colour = colour * linear.mean(axis=0)
        assert 0.01 < colour.mean() < 0.8, (material.name, colour)
        assert colour.max() < 0.9, (material.name, colour)
    stone = next(m for m in scene.materials if m.name == "stone")
    texels = scene.textures[stone.texture][..., :3].astype(np.float64) / 255
    assert 0.3 < (texels**2.2 @ [0.2126, 0.7152, 0.0722]).mean() < 0.65


@pytest.mark.parametrize("name", ["cornell", "atrium", "lamps"])
def test_normals_agree_with_the_triangles_they_belong_to(scenes: dict[str, Scene], name: str) -> None:
    corners, normals = triangles_of(scenes[name])
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(face, axis=1)
    assert area.min() > 0
    along = np.einsum("tc,tkc->tk", face / area[:, None], normals)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=2e-3)
    assert (along.max(axis=1) > 0).all(), "a triangle faces away from all three of its normals"
    assert (along > 0).mean() > 0.99


def test_sun_reaches_one_side_of_the_court_only(scenes: dict[str, Scene]) -> None:
    """Most of the picture must be indirect light: rays from the two long walls toward the sun, by embreex."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore import EmbreeDevice
    from embreex.rtcore_scene import EmbreeScene

    corners, _ = triangles_of(scenes["atrium"], without="leaves")
    device = EmbreeDevice()
    world = EmbreeScene(device)
    TriangleMesh(world, corners.astype(np.float32))
    y, z = (g.ravel() for g in np.meshgrid(np.linspace(5.6, 10.4, 40), np.linspace(-12, 12, 80)))
    to_sun = np.tile(np.array(scenes["atrium"].suns[0].to_sun, np.float32), (len(y), 1))
    lit = {}
    for side in (-1, 1):
        start = np.stack([np.full_like(y, side * 4.9), y, z], axis=1).astype(np.float32)
        lit[side] = (world.run(start, to_sun, query="OCCLUDED") == -1).mean()
    assert lit[1] > 0.5, lit
    assert lit[-1] < 0.02, lit
    x, z = (g.ravel() for g in np.meshgrid(np.linspace(-4, 4, 60), np.linspace(-11, 11, 120)))
    floor = np.stack([x, np.full_like(x, 0.01), z], axis=1).astype(np.float32)
    share = (world.run(floor, to_sun[:1].repeat(len(floor), axis=0), query="OCCLUDED") == -1).mean()
    assert 0.03 < share < 0.4, share


def test_lamps_are_twenty_thousand_in_free_air(root: Path, scenes: dict[str, Scene]) -> None:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore import EmbreeDevice
    from embreex.rtcore_scene import EmbreeScene

    file = np.load(root / "scenes" / "lamps" / "lamps.npz")
    position, intensity = file["position"], file["intensity"]
    assert position.shape == intensity.shape == (20_000, 3)
    assert position.dtype == intensity.dtype == np.float32
    assert np.isfinite(position).all() and np.isfinite(intensity).all()
    assert (intensity >= 0).all() and (intensity.max(axis=1) > 0).all()
    assert len(np.unique(position, axis=0)) == 20_000

    corners, _ = triangles_of(scenes["lamps"])
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    device = EmbreeDevice()
    world = EmbreeScene(device)
    TriangleMesh(world, corners.astype(np.float32))
    steps = np.array([(a, b, c) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1) if (a, b, c) != (0, 0, 0)])
    near, behind = np.full(20_000, np.inf), np.zeros(20_000)
    for direction in steps / np.linalg.norm(steps, axis=1, keepdims=True) + [0.013, 0.007, -0.011]:
        rays = np.tile(direction.astype(np.float32), (20_000, 1))
        hit = world.run(position, rays, output=True)
        struck = hit["primID"] >= 0
        near[struck] = np.minimum(near[struck], hit["tfar"][struck])
        behind[struck] += face[hit["primID"][struck]] @ direction > 0
    assert near.min() > 0.01, "a lamp is nearer than 1 cm to a surface"
    assert behind.max() < 0.7 * len(steps), "a lamp is inside a solid: nearly all it sees is back faces"


def test_lamps_scene_is_lit_by_its_list_alone(scenes: dict[str, Scene]) -> None:
    scene = scenes["lamps"]
    assert isinstance(scene.light_list, Lights) and len(scene.light_list.position) == 20_000
    assert not scene.suns and not scene.points and not scene.spots
    assert not any(max(m.emission) > 0 for m in scene.materials)
    assert [c.name for c in scene.cameras] == ["main", "balcony"]
    low, high = scene.bounds
    assert (scene.light_list.position > low).all() and (scene.light_list.position < high).all()


@pytest.mark.parametrize("name", MADE)
def test_other_readers_see_the_same_triangles(root: Path, scenes: dict[str, Scene], name: str) -> None:
    import open3d as o3d
    import trimesh

    path = root / "scenes" / name / f"{name}.glb"
    low, high = scenes[name].bounds
    model = o3d.io.read_triangle_model(str(path))
    assert sum(len(m.mesh.triangles) for m in model.meshes) == scenes[name].triangles
    points = np.concatenate([np.asarray(m.mesh.vertices) for m in model.meshes])
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [low, high], atol=1e-3)
    whole = trimesh.load_scene(path, process=False)
    assert (
        sum(len(whole.geometry[whole.graph[n][1]].faces) for n in whole.graph.nodes_geometry) == scenes[name].triangles
    )
    np.testing.assert_allclose(whole.bounds, [low, high], atol=1e-3)
