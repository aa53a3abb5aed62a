"""glTF and GLB: what is in the file comes out of load_scene, numbers and all."""

from __future__ import annotations

import base64
import json
import math
from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.scene.load import load_scene

from .scene_files import QUAD, QUAD_UV, TRIANGLES, Gltf, pack_glb, png, quad_glb

NORMALS = np.tile(np.float32([0, 0, 1]), (4, 1))


def test_geometry_comes_out_as_it_went_in(tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(NORMAL=NORMALS, TEXCOORD_0=QUAD_UV, material=gltf.material(name="a")))
    mesh = load_scene(gltf.save(tmp_path / "a.GLB")).meshes[0]
    assert mesh.position.dtype == np.float32 and mesh.index.dtype == np.uint32
    assert mesh.position.flags.c_contiguous and mesh.index.flags.c_contiguous
    np.testing.assert_array_equal(mesh.position, QUAD)
    np.testing.assert_array_equal(mesh.index, TRIANGLES)
    np.testing.assert_array_equal(mesh.normal, NORMALS)
    np.testing.assert_array_equal(mesh.uv, QUAD_UV)


def test_texture_coordinates_and_texture(tmp_path: Path) -> None:
    image = np.arange(2 * 3 * 4, dtype=np.uint8).reshape(2, 3, 4) * 10
    gltf = Gltf()
    material = gltf.material(pbrMetallicRoughness={"baseColorTexture": {"index": gltf.texture(image)}})
    gltf.node(mesh=gltf.mesh(TEXCOORD_0=QUAD_UV, material=material))
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert scene.materials[0].texture == 0
    np.testing.assert_array_equal(scene.textures[0], image)
    np.testing.assert_array_equal(scene.meshes[0].uv, QUAD_UV)


def test_two_materials_share_one_image(tmp_path: Path) -> None:
    gltf = Gltf()
    texture = gltf.texture(np.full((2, 2, 4), 200, dtype=np.uint8))
    for _ in range(2):
        material = gltf.material(pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
        gltf.node(mesh=gltf.mesh(TEXCOORD_0=QUAD_UV, material=material))
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert [m.texture for m in scene.materials] == [0, 0] and len(scene.textures) == 1


def test_integer_texture_coordinates_and_colours_are_scaled(tmp_path: Path) -> None:
    gltf = Gltf()
    texture = gltf.texture(np.full((1, 1, 4), 255, dtype=np.uint8))
    material = gltf.material(pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    colours = np.array([[255, 0, 51, 255]] * 4, dtype=np.uint8)
    uv = (QUAD_UV * 65535).astype(np.uint16)
    gltf.node(mesh=gltf.mesh(
        TEXCOORD_0=uv, COLOR_0=colours, material=material, normalized=("TEXCOORD_0", "COLOR_0")))  # fmt: skip
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    np.testing.assert_allclose(mesh.uv, QUAD_UV, atol=1e-7)
    np.testing.assert_allclose(mesh.colour, np.tile([1, 0, 0.2], (4, 1)), atol=1e-7)


def test_texture_transform(tmp_path: Path) -> None:
    gltf = Gltf()
    change = {"offset": [0.5, 0.25], "rotation": math.pi / 2, "scale": [2, 3]}
    info = {"index": gltf.texture(np.zeros((1, 1, 4), np.uint8)), "extensions": {"KHR_texture_transform": change}}
    gltf.node(
        mesh=gltf.mesh(TEXCOORD_0=QUAD_UV, material=gltf.material(pbrMetallicRoughness={"baseColorTexture": info}))
    )
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    # The extension's own formula: translation * rotation * scale, rotation [c s; -s c].
    matrix = np.array([[0, 1], [-1, 0]]) @ np.diag([2, 3])
    np.testing.assert_allclose(mesh.uv, QUAD_UV @ matrix.T + [0.5, 0.25], atol=1e-6)


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (5, [0, 1, 3, 2], [{0, 1, 3}, {1, 3, 2}]),
        (6, [0, 1, 2, 3], [{0, 1, 2}, {0, 2, 3}]),
        (6, None, [{0, 1, 2}, {0, 2, 3}]),
        (4, None, [{0, 1, 2}]),
    ],
)
def test_strips_fans_and_no_indices(
    tmp_path: Path, mode: int, indices: list[int] | None, expected: list[set[int]]
) -> None:
    gltf = Gltf()
    positions = QUAD if mode != 4 else QUAD[:3]
    given = None if indices is None else np.array(indices, dtype=np.uint8)
    gltf.node(mesh=gltf.mesh(given, mode=mode, POSITION=positions))
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    assert [set(map(int, face)) for face in mesh.index] == expected
    corner = mesh.position[mesh.index]
    facing = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 2]
    assert (facing > 0).all()


def test_node_transforms_multiply_and_instances_repeat(tmp_path: Path) -> None:
    gltf = Gltf()
    mesh = gltf.mesh(NORMAL=NORMALS)
    half = math.sqrt(0.5)
    parent = gltf.node(translation=[10, 0, 0], rotation=[0, half, 0, half], scale=[2, 2, 2])
    gltf.node(parent, mesh=mesh, translation=[0, 1, 0])
    gltf.node(mesh=mesh)
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert len(scene.meshes) == 2
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # a quarter turn about y takes z to x
    expected = (QUAD + np.array([0, 1, 0])) * 2 @ turn.T + [10, 0, 0]
    np.testing.assert_allclose(scene.meshes[0].position, expected, atol=1e-5)
    np.testing.assert_allclose(scene.meshes[0].normal, np.tile([1, 0, 0], (4, 1)), atol=1e-6)
    np.testing.assert_array_equal(scene.meshes[1].position, QUAD)


def test_mirrored_node_keeps_its_front(tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(NORMAL=NORMALS), scale=[-1, 1, 3])
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    corner = mesh.position[mesh.index]
    facing = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (facing[:, 2] > 0).all()
    np.testing.assert_allclose(mesh.normal, NORMALS, atol=1e-6)


def test_matrix_and_nonuniform_scale_carry_normals(tmp_path: Path) -> None:
    gltf = Gltf()
    slant = np.tile(np.float32([0.6, 0, 0.8]), (4, 1))
    matrix = np.diag([2.0, 1.0, 1.0, 1.0])
    gltf.node(mesh=gltf.mesh(NORMAL=slant), matrix=matrix.T.ravel().tolist())
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    expected = np.array([0.3, 0, 0.8]) / math.hypot(0.3, 0.8)
    np.testing.assert_allclose(mesh.normal, np.tile(expected, (4, 1)), atol=1e-6)


def test_bad_normals_become_geometric_ones(tmp_path: Path) -> None:
    normals = np.float32([[0, 0, 0], [np.nan, 0, 1], [0, 0, 2], [3, 0, 4]])
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(NORMAL=normals))
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    np.testing.assert_allclose(mesh.normal, [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0.6, 0, 0.8]], atol=1e-6)


def test_materials(tmp_path: Path) -> None:
    gltf = Gltf()
    emission = {"KHR_materials_emissive_strength": {"emissiveStrength": 20.0}}
    gltf.material(name="lamp", emissiveFactor=[1, 0.5, 0.25], extensions=emission, doubleSided=True)
    gltf.material(name="leaf", alphaMode="MASK", alphaCutoff=0.3, pbrMetallicRoughness={"metallicFactor": 1})
    gltf.material(name="glass", alphaMode="BLEND", pbrMetallicRoughness={"baseColorFactor": [0.1, 0.2, 0.3, 0.4]})
    gltf.material(name="opaque", pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, 0.2]})
    for row in range(4):
        gltf.node(mesh=gltf.mesh(material=row))
    lamp, leaf, glass, opaque = load_scene(gltf.save(tmp_path / "a.glb")).materials
    assert lamp.emission == (20.0, 10.0, 5.0) and lamp.two_sided and not leaf.two_sided
    assert (lamp.alpha_cutoff, leaf.alpha_cutoff, glass.alpha_cutoff, opaque.alpha_cutoff) == (0, 0.3, 0.5, 0)
    assert glass.base_colour == (0.1, 0.2, 0.3) and glass.alpha == 0.4
    assert leaf.base_colour == (1, 1, 1) and leaf.emission == (0, 0, 0)


def test_emissive_texture_is_averaged_in_linear_light(tmp_path: Path) -> None:
    image = np.zeros((1, 2, 4), dtype=np.uint8)
    image[0, 0] = (255, 188, 0, 255)
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(material=gltf.material(
        emissiveFactor=[1, 1, 1], emissiveTexture={"index": gltf.texture(image)})))  # fmt: skip
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    linear = ((188 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(scene.materials[0].emission, [0.5, linear / 2, 0], rtol=1e-5)
    assert any("emissive texture" in note for note in scene.notes)


def test_broken_and_missing_pictures_leave_plain_colour(tmp_path: Path) -> None:
    gltf = Gltf()
    broken = gltf.texture(png(np.zeros((8, 8, 4), np.uint8))[:40])
    gltf.node(mesh=gltf.mesh(material=gltf.material(pbrMetallicRoughness={"baseColorTexture": {"index": broken}})))
    gltf.json["images"].append({"uri": "gone.png"})
    gltf.json["textures"].append({"source": 1})
    gltf.node(mesh=gltf.mesh(material=gltf.material(pbrMetallicRoughness={"baseColorTexture": {"index": 1}})))
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert [m.texture for m in scene.materials] == [-1, -1] and scene.textures == []
    assert any("broken" in note for note in scene.notes) and any("gone.png" in note for note in scene.notes)


def test_lights_and_cameras_follow_their_nodes(tmp_path: Path) -> None:
    gltf = quad_glb()
    lights = [
        {"type": "directional", "color": [1, 0.5, 0.25], "intensity": 4},
        {"type": "point", "intensity": 7},
        {"type": "spot", "intensity": 2, "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.5}},
    ]
    gltf.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    gltf.json["cameras"] = [
        {"type": "perspective", "name": "eye", "perspective": {"yfov": 0.7, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}},
    ]
    half = math.sqrt(0.5)
    base = gltf.node(translation=[1, 2, 3], rotation=[-half, 0, 0, half])  # -z turns to -y
    for k in range(3):
        gltf.node(base, extensions={"KHR_lights_punctual": {"light": k}}, translation=[0, 0, 5])
    gltf.node(base, camera=0)
    gltf.node(camera=1)
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    place = [1, 7, 3]  # 5 along the turned z, which is y
    np.testing.assert_allclose(scene.suns[0].to_sun, [0, 1, 0], atol=1e-7)
    assert scene.suns[0].irradiance == (4, 2, 1)
    np.testing.assert_allclose(scene.points[0].position, place, atol=1e-6)
    assert scene.points[0].intensity == (7, 7, 7)
    spot = scene.spots[0]
    np.testing.assert_allclose(spot.position, place, atol=1e-6)
    np.testing.assert_allclose(spot.direction, [0, -1, 0], atol=1e-7)
    assert spot.outer_angle == 0.5 and 0.499 < spot.inner_angle < 0.5
    (camera,) = scene.cameras
    assert camera.name == "eye" and camera.fov_y_deg == pytest.approx(math.degrees(0.7))
    np.testing.assert_allclose(np.subtract(camera.target, camera.eye), [0, -1, 0], atol=1e-7)
    np.testing.assert_allclose(camera.up, [0, 0, -1], atol=1e-7)
    assert any("perspective" in note for note in scene.notes)


def test_gltf_with_data_uris_and_with_a_file_beside(tmp_path: Path) -> None:
    gltf = quad_glb()
    document = gltf.document()
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(gltf.binary).decode()
    (tmp_path / "inside.gltf").write_text(json.dumps(document))
    document["buffers"][0]["uri"] = "two%20words.bin"
    (tmp_path / "beside.gltf").write_text(json.dumps(document))
    (tmp_path / "two words.bin").write_bytes(gltf.binary)
    for name in ("inside.gltf", "beside.gltf"):
        np.testing.assert_array_equal(load_scene(tmp_path / name).meshes[0].position, QUAD)
    (tmp_path / "two words.bin").unlink()
    with pytest.raises(LabError, match=r"no file 'two%20words.bin'"):
        load_scene(tmp_path / "beside.gltf")


def test_interleaved_attributes(tmp_path: Path) -> None:
    gltf = Gltf()
    rows = np.concatenate([QUAD, NORMALS], axis=1).astype("<f4")
    view = gltf.view(rows.tobytes(), byteStride=24)
    for offset in (0, 12):
        gltf.json["accessors"].append(
            {"bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 4, "type": "VEC3"}
        )
    indices = gltf.array(TRIANGLES.ravel())
    gltf.json["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": indices}]}]
    gltf.node(mesh=0)
    mesh = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0]
    np.testing.assert_array_equal(mesh.position, QUAD)
    np.testing.assert_array_equal(mesh.normal, NORMALS)


def test_primitives_without_a_material_are_white(tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(material=gltf.material(name="a", pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1]})))
    gltf.node(mesh=gltf.mesh())
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert [scene.materials[mesh.material].base_colour for mesh in scene.meshes] == [(0, 0, 0), (1, 1, 1)]


def test_lines_are_left_out_with_a_note(tmp_path: Path) -> None:
    gltf = quad_glb()
    gltf.node(mesh=gltf.mesh(np.array([0, 1], dtype=np.uint8), mode=1))
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert scene.triangles == 2 and any("lines" in note for note in scene.notes)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d["accessors"][0].update(count=3), "refers to vertex 3, but there are 3"),
        (lambda d: d["accessors"][0].update(count=2**40), "needs .* bytes"),
        (lambda d: d["accessors"][1].update(count=5), "no whole number of triangles"),
        (lambda d: d["accessors"][1].update(bufferView=7), r"bufferViews\[7\], but there are 2"),
        (lambda d: d["accessors"][0].update(sparse={"count": 1}), "sparse"),
        (lambda d: d["accessors"][0].update(componentType=5), "component type"),
        (lambda d: d["accessors"][0].update(byteOffset=-4), "byteOffset"),
        (lambda d: d["accessors"][0].pop("bufferView"), "no data"),
        (lambda d: d["bufferViews"][0].update(byteLength=10**9), "the buffer has"),
        (lambda d: d["bufferViews"][0].update(byteStride=4), "byteStride"),
        (lambda d: d["buffers"][0].update(byteLength=10**9), "cut off"),
        (lambda d: d["meshes"][0]["primitives"][0].update(material=3), r"materials\[3\]"),
        (lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop("POSITION"), "no POSITION"),
        (lambda d: d["meshes"][0]["primitives"][0].update(mode=1), "no triangles"),
        (lambda d: d["nodes"][0].update(mesh="x"), r"meshes\['x'\]"),
        (lambda d: d["nodes"][0].update(children=[0]), "own ancestor"),
        (lambda d: d["nodes"][0].update(translation=[1, 2]), "3 finite numbers"),
        (lambda d: d["nodes"][0].update(scale=[0, 0, 0]), "0 units across"),
        (lambda d: d["nodes"][0].update(scale=[1e30, 1e30, 1e30]), "units across"),
        (lambda d: d["scenes"][0].update(nodes=[4]), r"nodes\[4\]"),
        (lambda d: d.update(nodes=5), "list of objects"),
        (lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        (lambda d: d["materials"][0].update(alphaMode="ODD"), "alphaMode"),
        (lambda d: d["materials"][0].update(emissiveFactor=[1, 2]), "emissiveFactor"),
        (lambda d: d["materials"][0].update(pbrMetallicRoughness={"baseColorFactor": [2, 0, 0, 1]}), "baseColorFactor"),
        (lambda d: d["asset"].update(version="1.0"), "asset.version"),
    ],
)  # fmt: skip
def test_broken_documents_say_what_is_wrong(tmp_path: Path, change: object, message: str) -> None:
    gltf = quad_glb()
    document = gltf.document()
    change(document)  # type: ignore[operator]
    path = tmp_path / "a.glb"
    path.write_bytes(pack_glb(document, gltf.binary))
    with pytest.raises(LabError, match=message) as caught:
        load_scene(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_nan_vertex_is_named(tmp_path: Path) -> None:
    positions = QUAD.copy()
    positions[2, 1] = np.nan
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(POSITION=positions))
    with pytest.raises(LabError, match="vertex 2 is at"):
        load_scene(gltf.save(tmp_path / "a.glb"))


def test_a_chain_of_thousands_of_nodes(tmp_path: Path) -> None:
    gltf = Gltf()
    mesh = gltf.mesh()
    node = None
    for _ in range(3000):
        node = gltf.node(node, translation=[1, 0, 0])
    gltf.node(node, mesh=mesh)
    found = load_scene(gltf.save(tmp_path / "a.glb")).meshes[0].position
    np.testing.assert_array_equal(found, QUAD + np.float32([3000, 0, 0]))
