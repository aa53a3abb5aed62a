"""OBJ with MTL, and PLY."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.scene.load import load_scene

from .scene_files import QUAD, ply, png

QUAD_LINES = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def obj(tmp_path: Path, text: str, mtl: str | None = None) -> Path:
    (tmp_path / "a.obj").write_text(text)
    if mtl is not None:
        (tmp_path / "a.mtl").write_text(mtl)
    return tmp_path / "a.obj"


def srgb(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def corners(scene: object) -> np.ndarray:
    return np.concatenate([mesh.position[mesh.index] for mesh in scene.meshes])  # type: ignore[attr-defined]


@pytest.mark.parametrize("face", ["f 1 2 3 4", "f -4 -3 -2 -1", "f 1// 2// 3// 4//", "f 1 2 \\\n3 4"])
def test_obj_quads_become_two_triangles(tmp_path: Path, face: str) -> None:
    scene = load_scene(obj(tmp_path, QUAD_LINES + face + "\n"))
    np.testing.assert_array_equal(corners(scene), QUAD[[[0, 1, 2], [0, 2, 3]]])


def test_obj_negative_indices_count_from_where_they_stand(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n"
    found = corners(load_scene(obj(tmp_path, text)))
    np.testing.assert_array_equal(found[:, 0], [[0, 0, 0], [5, 0, 0]])


def test_obj_small_numbers_and_ngons(tmp_path: Path) -> None:
    text = "v 1e-3 0 0\nv 2.5e-5 1 0\nv -1e+0 0 0\nv 0 -1 0\nv 0.5 -1 0\nf 1 2 3 4 5\n"
    scene = load_scene(obj(tmp_path, text))
    vertices = np.float32([[1e-3, 0, 0], [2.5e-5, 1, 0], [-1, 0, 0], [0, -1, 0], [0.5, -1, 0]])
    np.testing.assert_array_equal(corners(scene), vertices[[[0, 1, 2], [0, 2, 3], [0, 3, 4]]])


def test_obj_texture_coordinates_turn_down_and_normals_are_unit(tmp_path: Path) -> None:
    text = QUAD_LINES + "vt 0 0\nvt 1 0.25\nvn 0 0 2\nf 1/1/1 2/2/1 3/1/1\n"
    mesh = load_scene(obj(tmp_path, text)).meshes[0]
    at = {tuple(p): k for k, p in enumerate(mesh.position.tolist())}
    np.testing.assert_allclose(mesh.uv[at[1, 0, 0]], [1, 0.75])
    np.testing.assert_allclose(mesh.uv[at[1, 1, 0]], [0, 1])
    np.testing.assert_allclose(mesh.normal, np.tile([0, 0, 1], (len(mesh.position), 1)))


def test_obj_faces_with_and_without_coordinates_mix(tmp_path: Path) -> None:
    text = QUAD_LINES + "vt 0.5 0.5\nvn 0 1 0\nf 1/1/1 2/1/1 3/1/1\nf 1 3 4\n"
    scene = load_scene(obj(tmp_path, text))
    (mesh,) = scene.meshes
    assert scene.triangles == 2
    np.testing.assert_allclose(mesh.uv[mesh.index[0]], 0.5)
    np.testing.assert_allclose(mesh.normal[mesh.index[0]], [[0, 1, 0]] * 3)
    np.testing.assert_allclose(mesh.normal[mesh.index[1]], [[0, 0, 1]] * 3)  # the geometric one


def test_mtl(tmp_path: Path) -> None:
    image = np.full((2, 2, 4), 255, dtype=np.uint8)
    image[..., :3] = [10, 20, 30]
    (tmp_path / "t.png").write_bytes(png(image))
    (tmp_path / "m.png").write_bytes(png(np.array([[0, 255], [255, 255]], dtype=np.uint8)))
    mtl = (
        "newmtl red\nKd 0.8 0.1 0.05\nKe 3 2 1\nnewmtl both\nKd 0.5 0.6 0.7\nmap_Kd t.png\n"
        "newmtl grey\nKd 0.4 0.4 0.4\nmap_Kd t.png\nmap_d m.png\nnewmtl gone\nKd 0.3 0.3 0.3\nmap_Kd gone.png\n"
        "newmtl thin\nKd 1 1 1\nd 0.25\n"
    )
    names = ["red", "both", "grey", "gone", "thin"]
    faces = "".join(f"usemtl {name}\nf 1/1 2/1 3/1\n" for name in names)
    scene = load_scene(obj(tmp_path, "mtllib a.mtl\n" + QUAD_LINES + "vt 0 0\n" + faces, mtl))
    found = {material.name: material for material in scene.materials}
    assert set(found) == set(names) and len(scene.meshes) == 5
    assert found["red"].base_colour == (0.8, 0.1, 0.05) and found["red"].emission == (3, 2, 1)
    assert found["both"].base_colour == (0.5, 0.6, 0.7) and found["both"].texture >= 0
    assert found["grey"].base_colour == (1, 1, 1) and found["grey"].alpha_cutoff == 0.5
    np.testing.assert_array_equal(scene.textures[found["both"].texture], image)
    np.testing.assert_array_equal(scene.textures[found["grey"].texture][..., 3], [[0, 255], [255, 255]])
    assert found["gone"].texture == -1 and found["gone"].base_colour == (0.3, 0.3, 0.3)
    assert found["thin"].alpha == 0.25 and found["thin"].alpha_cutoff == 0.5
    notes = " | ".join(scene.notes)
    assert "gone.png" in notes and "grey Kd" in notes


def test_missing_mtl_is_a_note(tmp_path: Path) -> None:
    scene = load_scene(obj(tmp_path, "mtllib b.mtl\n" + QUAD_LINES + "usemtl x\nf 1 2 3\n"))
    assert scene.triangles == 1 and any("b.mtl" in note for note in scene.notes)


def test_obj_vertex_colours_are_srgb(tmp_path: Path) -> None:
    scene = load_scene(obj(tmp_path, "v 0 0 0 1 0.5 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1 0.5 0\nf 1 2 3\n"))
    np.testing.assert_allclose(scene.meshes[0].colour, np.tile([1, srgb(0.5), 0], (3, 1)), rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# nothing\n", "no vertices"),
        (QUAD_LINES, "no faces"),
        (QUAD_LINES + "l 1 2\np 3\n", "no faces"),
        (QUAD_LINES + "f 1 2 9\n", "line 5: the face refers to v 9, but there are 4"),
        (QUAD_LINES + "f 1 2 -9\n", "line 5: the face refers to v -9"),
        (QUAD_LINES + "f 0 1 2\n", "line 5: the face refers to v 0"),
        (QUAD_LINES + "f 1/4 2/4 3/4\n", "refers to vt 4"),
        (QUAD_LINES + "f 1 2\n", "3 corners or more"),
        (QUAD_LINES + "f 1 2 x\n", "'x' is no corner"),
        ("v 0 nan 0\n" + QUAD_LINES + "f 1 2 3\n", "line 1: vertex at"),
        ("v 0 0\n" + QUAD_LINES + "f 1 2 3\n", "line 1: 'v' needs numbers"),
        ("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "one point"),
        ("v 1e300 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", "vertex 0"),
        ("v 1e20 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", "units across"),
        ("\0\0", "binary"),
    ],
)
def test_bad_obj(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(LabError, match=message):
        load_scene(obj(tmp_path, text))


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("faces", [[[0, 1, 2]], [[0, 1, 2, 3]], [[0, 1, 2], [0, 1, 2, 3]], [[0, 1, 2, 3], [0, 2, 3]]])
def test_ply_faces(tmp_path: Path, form: str, faces: list[list[int]]) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(ply(QUAD, faces, form))
    scene = load_scene(path)
    np.testing.assert_array_equal(scene.meshes[0].position, QUAD)
    area = np.linalg.norm(np.cross(*np.diff(corners(scene).astype(float), axis=1).transpose(1, 0, 2)), axis=1) / 2
    assert area.sum() == pytest.approx(sum(0.5 if len(face) == 3 else 1.0 for face in faces))


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_ply_colours_and_normals(tmp_path: Path, form: str) -> None:
    extra = "float nx,float ny,float nz,uchar red,uchar green,uchar blue"
    rows = np.hstack([QUAD, np.tile([0, 0, 2, 255, 128, 0], (4, 1))])
    path = tmp_path / "a.PLY"
    path.write_bytes(ply(rows, [[0, 1, 2]], form, extra))
    mesh = load_scene(path).meshes[0]
    np.testing.assert_allclose(mesh.colour, np.tile([1, srgb(128 / 255), 0], (4, 1)), rtol=1e-5)
    np.testing.assert_allclose(mesh.normal, np.tile([0, 0, 1], (4, 1)))


def test_ply_float_colours(tmp_path: Path) -> None:
    rows = np.hstack([QUAD, np.tile([1, 0.5, 0], (4, 1))])
    (tmp_path / "a.ply").write_bytes(ply(rows, [[0, 1, 2]], extra="float red,float green,float blue"))
    mesh = load_scene(tmp_path / "a.ply").meshes[0]
    np.testing.assert_allclose(mesh.colour, np.tile([1, srgb(0.5), 0], (4, 1)), rtol=1e-5)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([[0, 1, 99]], "face 0 is"),
        ([[0, 1, 2], [0, 1, 2, -7]], "face 1 is"),
        ([[0, 1, 2, 99_999_999]], "there are 4 vertices"),
        ([[0, 1]], "has 2 corners"),
        ([[0, 1, 2], []], "has 0 corners|no corners"),
        ([[0, 0, 0, 0, 0]], "only 0 of its 3 triangles"),
        ([], "no faces"),
        (None, "points and no faces"),
    ],
)
def test_bad_ply_faces(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], form: str, faces: list[list[int]] | None, message: str
) -> None:
    (tmp_path / "a.ply").write_bytes(ply(QUAD, faces, form))
    with pytest.raises(LabError, match=message):
        load_scene(tmp_path / "a.ply")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_ply_cut_off_anywhere(tmp_path: Path, capfd: pytest.CaptureFixture[str], form: str) -> None:
    whole = ply(QUAD, [[0, 1, 2], [0, 1, 2, 3]], form)
    for length in range(len(whole) - 2):
        (tmp_path / "a.ply").write_bytes(whole[:length])
        with pytest.raises(LabError, match=r"a\.ply"):
            load_scene(tmp_path / "a.ply")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_ply_nan_vertex(tmp_path: Path, form: str) -> None:
    vertices = QUAD.copy()
    vertices[1, 2] = np.nan
    (tmp_path / "a.ply").write_bytes(ply(vertices, [[0, 1, 2]], form))
    with pytest.raises(LabError, match="vertex 1 holds a number that is not finite"):
        load_scene(tmp_path / "a.ply")


def test_ply_header_lies(tmp_path: Path) -> None:
    text = ply(QUAD, [[0, 1, 2]]).decode()
    changes = {
        ("element vertex 4", "element vertex 100000000000"): "cut off",
        ("property float x", "property float q"): "no column 'x'",
        ("vertex_indices", "corners"): "vertex_indices",
        ("format ascii 1.0", "format odd 1.0"): "format odd",
        ("property float y", "property quad y"): "quad y",
        ("end_header", "comment end_header"): "no end_header",
    }
    for (old, new), message in changes.items():
        (tmp_path / "a.ply").write_text(text.replace(old, new))
        with pytest.raises(LabError, match=message):
            load_scene(tmp_path / "a.ply")
