"""Any mesh or light list survives being written and read; no broken file does worse than a LabError."""

from __future__ import annotations

import json
import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from lab.errors import LabError
from lab.scene.lights import load_light_list
from lab.scene.load import load_scene

from ..unit.scene_files import QUAD, QUAD_UV, Gltf, pack_glb, ply

SIDECAR = json.dumps({"cameras": [{"name": "main", "eye": [0, 0, 9], "target": [0, 0, 0]}]})
"""Spares every example the search for an automatic camera."""


@contextmanager
def scene_folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "a.json").write_text(SIDECAR)
        yield Path(name)


floats = st.floats(-1e6, 1e6, width=32).map(lambda v: 0.0 if abs(v) < 1e-6 else v)


@st.composite
def meshes(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) of some extent, and triangles (t, 3); degenerate ones as they come."""
    count = draw(st.integers(3, 12))
    vertices = draw(hnp.arrays(np.float32, (count, 3), elements=floats))
    vertices[0], vertices[1] = (0, 0, 0), (1, 1, 1)
    others = draw(hnp.arrays(np.int64, (draw(st.integers(0, 8)), 3), elements=st.integers(0, count - 1)))
    return vertices, np.vstack([[[0, 1, 2]], others])


def write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    lines = ["v " + " ".join(repr(float(x)) for x in vertex) for vertex in vertices]
    path.write_text("\n".join(lines + ["f " + " ".join(str(k + 1) for k in face) for face in faces]))


def write_ply(path: Path, vertices: np.ndarray, faces: np.ndarray, form: str) -> None:
    path.write_bytes(ply(vertices, [[int(k) for k in face] for face in faces], form))


def write_glb(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(faces.astype(np.uint16), POSITION=vertices))
    gltf.save(path)


WRITERS: dict[str, tuple[str, Callable[[Path, np.ndarray, np.ndarray], None]]] = {
    "obj": ("a.obj", write_obj),
    "ply text": ("a.ply", lambda *mesh: write_ply(*mesh, "ascii")),
    "ply little": ("a.ply", lambda *mesh: write_ply(*mesh, "binary_little_endian")),
    "ply big": ("a.ply", lambda *mesh: write_ply(*mesh, "binary_big_endian")),
    "glb": ("a.glb", write_glb),
}


@pytest.mark.parametrize("kind", WRITERS)
@settings(max_examples=25, deadline=None)
@given(mesh=meshes())
def test_meshes_come_back_corner_by_corner(kind: str, mesh: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = mesh
    name, write = WRITERS[kind]
    with scene_folder() as folder:
        write(folder / name, vertices, faces)
        scene = load_scene(folder / name)
    (found,) = scene.meshes
    np.testing.assert_array_equal(found.position[found.index], vertices[faces])
    assert found.position.dtype == np.float32 and found.index.dtype == np.uint32


@st.composite
def light_lists(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    count = draw(st.integers(1, 20))
    position = draw(hnp.arrays(np.float32, (count, 3), elements=floats))
    return position, np.abs(draw(hnp.arrays(np.float32, (count, 3), elements=floats)))


@pytest.mark.parametrize("ending", [".npz", ".csv", ".ply"])
@settings(max_examples=25, deadline=None)
@given(lights=light_lists())
def test_light_lists_come_back(ending: str, lights: tuple[np.ndarray, np.ndarray]) -> None:
    position, intensity = lights
    rows = np.hstack([position, intensity])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{ending}"
        if ending == ".npz":
            np.savez(path, position=position, intensity=intensity)
        elif ending == ".csv":
            path.write_text("x,y,z,r,g,b\n" + "\n".join(",".join(repr(float(v)) for v in row) for row in rows))
        else:
            path.write_bytes(ply(rows, None, "binary_little_endian", "float red,float green,float blue"))
        found = load_light_list(path)
    np.testing.assert_array_equal(found.position, position)
    np.testing.assert_allclose(found.flux, intensity * (4 * np.pi), rtol=3e-7)


def whole_glb() -> bytes:
    """Uses much of the format: two nodes, a texture, a light, a camera, normals, an emissive material."""
    gltf = Gltf()
    material = gltf.material(
        name="a",
        pbrMetallicRoughness={"baseColorTexture": {"index": gltf.texture(np.full((2, 2, 4), 90, np.uint8))}},
        emissiveFactor=[1, 1, 1],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}},
    )
    normals = np.tile(np.float32([0, 0, 1]), (4, 1))
    node = gltf.node(mesh=gltf.mesh(NORMAL=normals, TEXCOORD_0=QUAD_UV, material=material), scale=[1, 2, 1])
    gltf.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}}
    gltf.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    gltf.node(node, extensions={"KHR_lights_punctual": {"light": 0}}, camera=0, translation=[0, 0, 3])
    gltf.node(mesh=gltf.mesh(np.array([0, 1, 2, 3], dtype=np.uint8), mode=6))
    return gltf.bytes()


def whole_npz() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.npz"
        np.savez(path, position=QUAD, intensity=QUAD, normal=QUAD)
        return path.read_bytes()


COLOURS = "uchar red,uchar green,uchar blue"
ROWS = np.hstack([QUAD, QUAD * 200])
TOML = b"""name = "x"
geometry = ["b.obj"]
light_list = "l.csv"
[[camera]]
name = "main"
eye = [0, 0, 3]
target = [0, 0, 0]
[[spot]]
position = [0, 0, 3]
direction = [0, 0, -1]
intensity = [1, 1, 1]
"""
OBJ = (
    b"mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
    b"usemtl m\nf 1/1/1 2/2/1 -2/1/1 4/2/1\n"
)
WHOLE: dict[str, tuple[str, bytes]] = {
    "glb": ("a.glb", whole_glb()),
    "ply text": ("a.ply", ply(ROWS, [[0, 1, 2], [0, 1, 2, 3]], "ascii", COLOURS)),
    "ply mixed": ("a.ply", ply(ROWS, [[0, 1, 2], [0, 1, 2, 3]], "binary_little_endian", COLOURS)),
    "ply even": ("a.ply", ply(ROWS, [[0, 1, 2, 3], [3, 2, 1, 0]], "binary_big_endian", COLOURS)),
    "obj": ("a.obj", OBJ),
    "toml": ("a.toml", TOML),
    "npz list": ("l.npz", whole_npz()),
    "csv list": ("l.csv", b"x,y,z,r,g,b\n1,2,3,4,5,6\n7,8,9,1,2,3\n"),
    "ply list": ("l.ply", ply(ROWS, None, "binary_little_endian", COLOURS)),
}


@st.composite
def damage(draw: st.DrawFn, size: int) -> list[tuple[str, int, bytes]]:
    """Some bytes written over, cut out or put in, at random places."""
    place = st.integers(0, size - 1)
    kinds = st.sampled_from(["over", "over", "over", "out", "in"])
    piece = st.one_of(
        st.binary(min_size=1, max_size=4), st.sampled_from([b"9", b"-", b"nan", b"1e99", b"\xff" * 4, b"["])
    )
    return draw(st.lists(st.tuples(kinds, place, piece), min_size=1, max_size=6))


def damaged(data: bytes, harm: list[tuple[str, int, bytes]]) -> bytes:
    for kind, place, piece in harm:
        behind = place if kind == "in" else place + len(piece)
        data = data[:place] + (b"" if kind == "out" else piece) + data[behind:]
    return data


def read_any(folder: Path, name: str, data: bytes) -> None:
    """Loads `data` as the file `name`: fine, or a LabError; whatever else comes up fails the test."""
    (folder / "b.obj").write_bytes(OBJ)
    (folder / "b.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (folder / "l.csv").write_text("x,y,z,r,g,b\n1,2,3,4,5,6\n")
    (folder / name).write_bytes(data)
    try:
        if name.startswith("l."):
            load_light_list(folder / name)
        else:
            scene = load_scene(folder / name)
            assert all(np.isfinite(m.position).all() and m.index.max() < len(m.position) for m in scene.meshes)
    except LabError as problem:
        assert str(problem).strip() and "\n" not in str(problem)


@pytest.mark.parametrize("kind", WHOLE)
def test_undamaged_files_load(kind: str) -> None:
    name, data = WHOLE[kind]
    with scene_folder() as folder:
        read_any(folder, name, data)
        assert load_light_list(folder / name) if name.startswith("l.") else load_scene(folder / name)


@pytest.mark.parametrize("kind", WHOLE)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_damaged_files_raise_lab_errors_only(kind: str, data: st.DataObject) -> None:
    name, whole = WHOLE[kind]
    harm = data.draw(damage(len(whole)))
    with scene_folder() as folder:
        read_any(folder, name, damaged(whole, harm))


LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 2**70),
    st.floats(),
    st.text(max_size=3),
    st.sampled_from(["MASK", 5126]),
)
KEYS = st.sampled_from(["extensions", "index", "nodes", "mesh", "uri"])
JSON_VALUES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(KEYS, inner, max_size=3)),
    max_leaves=5,
)


def places(value: object, path: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Every place in a JSON document, as the keys that lead there."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, item in inner for place in places(item, (*path, key)))]


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_gltf_documents_with_any_value_anywhere(data: st.DataObject) -> None:
    whole = WHOLE["glb"][1]
    (length,) = struct.unpack_from("<I", whole, 12)
    document = json.loads(whole[20 : 20 + length])
    path = data.draw(st.sampled_from(places(document)[1:]))
    holder = document
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = data.draw(JSON_VALUES)
    with scene_folder() as folder:
        read_any(folder, "a.glb", pack_glb(document, whole[28 + length :]))
