"""What ``lab export -o scene.xml`` writes. What Mitsuba makes of it is tested in tests/external."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pytest
from PIL import Image

from lab.cli import main
from lab.errors import LabError
from lab.mitsuba_scene import MitsubaScene, export_mitsuba
from lab.mitsuba_scene.emitters import spot_ramp
from lab.mitsuba_scene.surfaces import alpha_between
from lab.params import Params
from lab.records import Lights
from lab.scene.scene import Camera, Material, Mesh, PointLight, Scene, SpotLight, SunLight

from .command_line import files, refused

CAMERA = Camera("main", (0.0, 1.0, 5.0), (0.0, 1.0, 0.0), fov_y_deg=40.0)


def triangle(material: int = 0, **more: np.ndarray) -> Mesh:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], np.float32)  # the last one is not used
    return Mesh(corners, np.array([[0, 1, 2]], np.uint32), material, **more)


def scene(**changes: object) -> Scene:
    return replace(Scene("made", [triangle()], [Material()], cameras=[CAMERA]), **changes)  # type: ignore[arg-type]


def exported(made: Scene, folder: Path, **settings: object) -> tuple[Element, MitsubaScene]:
    written = export_mitsuba(folder / "s.xml", made, made.camera(), (64, 36), Params().replace(**settings))
    return ElementTree.parse(folder / "s.xml").getroot(), written


def value(element: Element, path: str) -> str:
    found = element.find(path)
    assert found is not None, path
    return found.get("value", "")


def vector(text: str) -> np.ndarray:
    return np.array([float(part) for part in text.split(",")])


def read_ply(path: Path) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns by name, and the triangles."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    count = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    size = 4 * len(names) * count["vertex"]
    table = np.frombuffer(body[:size], "<f4").reshape(-1, len(names))
    faces = np.frombuffer(body[size:], [("count", "u1"), ("corner", "<i4", 3)])
    assert len(faces) == count["face"] and (faces["count"] == 3).all()
    return dict(zip(names, table.T, strict=True)), faces["corner"]


def test_view_and_paths(tmp_path: Path) -> None:
    root, written = exported(scene(), tmp_path, max_bounces=4, seed=7)
    assert written.files == [tmp_path / "s.xml", tmp_path / "s-mitsuba" / "mesh-000.ply"]
    assert all(file.is_file() for file in written.files)
    assert not written.notes
    defaults = {found.get("name"): found.get("value") for found in root.findall("default")}
    assert defaults == {"spp": "64", "max_depth": "6", "seed": "7", "width": "64", "height": "36"}
    integrator = root.find("integrator")
    assert integrator is not None and integrator.get("type") == "path"
    assert value(integrator, "integer[@name='max_depth']") == "$max_depth"
    sensor = root.find("sensor")
    assert sensor is not None
    assert (value(sensor, "float[@name='fov']"), value(sensor, "string[@name='fov_axis']")) == ("40", "y")
    look = sensor.find("transform/lookat")
    assert look is not None and vector(look.get("origin", "")).tolist() == list(CAMERA.eye)
    near, far = (float(value(sensor, f"float[@name='{name}_clip']")) for name in ("near", "far"))
    assert near < 1e-3 and far > 5
    assert sensor.find("film/rfilter[@type='box']") is not None


def test_meshes_keep_what_they_have(tmp_path: Path) -> None:
    normal = np.array([[0, 0.6, 0.8], [0, 0, 1], [0, 0, 0], [1, 0, 0]], np.float32)
    uv = np.array([[0, 0], [3, np.nan], [0.25, 0.5], [0, 0]], np.float32)
    colour = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [9, 9, 9]], np.float32)
    made = scene(
        meshes=[triangle(0, normal=normal, colour=colour), triangle(1, uv=uv), triangle(1, uv=uv), triangle(2)],
        materials=[Material(base_colour=(0.5, 1, 1)), Material(base_colour=(1, 1, 1), texture=0), Material()],
        textures=[np.full((2, 2, 4), 255, np.uint8)],
    )
    root, written = exported(made, tmp_path)
    coloured, triangles = read_ply(tmp_path / "s-mitsuba" / "mesh-000.ply")
    assert list(coloured) == ["x", "y", "z", "nx", "ny", "nz", "r", "g", "b"]
    assert triangles.tolist() == [[0, 1, 2]]
    np.testing.assert_array_equal(coloured["x"], [0, 1, 0])
    np.testing.assert_allclose(coloured["ny"], [0.6, 0, 0], atol=1e-7)
    np.testing.assert_allclose(coloured["nz"], [0.8, 1, 1], atol=1e-7)  # no normal: the triangle's
    np.testing.assert_allclose(coloured["r"], [0.5, 0, 0])
    np.testing.assert_allclose(coloured["b"], [0, 0, 1])
    textured, triangles = read_ply(tmp_path / "s-mitsuba" / "mesh-001.ply")  # both meshes of the material
    assert list(textured) == ["x", "y", "z", "u", "v"] and triangles.tolist() == [[0, 1, 2], [3, 4, 5]]
    np.testing.assert_array_equal(textured["u"], [0, 3, 0.25] * 2)
    np.testing.assert_array_equal(textured["v"], [0, 0, 0.5] * 2)  # not a number: 0, as ours has it
    assert len(root.findall("shape")) == 3
    faceted = [value(shape, "boolean[@name='face_normals']") for shape in root.findall("shape")]
    assert faceted == ["false", "true", "true"]
    assert root.find("shape/bsdf/bsdf/texture[@type='mesh_attribute']") is not None
    assert vector(value(root.findall("shape")[2], "bsdf/bsdf/rgb")).tolist() == pytest.approx([0.8] * 3)
    assert not written.notes


def test_tints_of_textures_are_multiplied_in_linear_light(tmp_path: Path) -> None:
    texels = np.random.default_rng(2).integers(0, 256, (3, 5, 4), dtype=np.uint8)
    texels[..., 3] = 255
    uv = np.zeros((4, 2), np.float32)
    colour = np.tile(np.array([[0.5, 1, 0.25]], np.float32), (4, 1))
    made = scene(
        meshes=[triangle(0, uv=uv), triangle(1, uv=uv, colour=colour)],
        materials=[Material(base_colour=(1, 1, 1), texture=0), Material(base_colour=(0.5, 1, 1), texture=0)],
        textures=[texels],
    )
    root, written = exported(made, tmp_path)
    folder = tmp_path / "s-mitsuba"
    np.testing.assert_array_equal(np.asarray(Image.open(folder / "texture-000.png")), texels[..., :3])
    data = (folder / "texture-000-times-0.25-1-0.25.pfm").read_bytes()
    assert data.startswith(b"PF\n5 3\n-1.0\n")
    pixels = np.frombuffer(data[-3 * 5 * 3 * 4 :], "<f4").reshape(3, 5, 3)[::-1]
    encoded = texels[..., :3].astype(np.float64) / 255
    linear = np.where(encoded > 0.04045, ((encoded + 0.055) / 1.055) ** 2.4, encoded / 12.92)
    np.testing.assert_allclose(pixels, linear * [0.25, 1, 0.25], rtol=1e-6)
    raw = [value(texture, "boolean[@name='raw']") for texture in root.iter("texture")]
    assert raw == ["false", "true"]
    assert not written.notes


def test_what_mitsuba_can_not_multiply_is_noted(tmp_path: Path) -> None:
    colour = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0.5], [9, 9, 9]], np.float32)
    made = scene(
        meshes=[triangle(0, uv=np.zeros((4, 2), np.float32), colour=colour)],
        materials=[Material("cloth", (1, 1, 1), texture=0)],
        textures=[np.full((1, 1, 4), 255, np.uint8)],
        background=(0.1, 0.2, 0.3),
    )
    _, written = exported(made, tmp_path)
    assert any("cloth" in note and "mean" in note for note in written.notes)
    assert any("background" in note for note in written.notes)
    assert (tmp_path / "s-mitsuba" / "texture-000-times-0.333333-0.666667-0.166667.pfm").is_file()


def test_holes_are_cut_where_ours_are(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    texels = rng.integers(0, 256, (4, 6, 4), dtype=np.uint8)
    made = scene(
        meshes=[triangle(0), triangle(1), triangle(2), triangle(3)],
        materials=[
            Material("leaf", texture=0, alpha=0.8, alpha_cutoff=0.4),
            Material("blind", texture=0, alpha_cutoff=0.0),
            Material("dense", texture=1, alpha_cutoff=0.5),
            Material("gone", alpha=0.2, alpha_cutoff=0.5),
        ],
        textures=[texels, np.full((2, 2, 4), 200, np.uint8)],
    )
    root, _ = exported(made, tmp_path)
    assert root.find("integrator[@type='volpath']") is not None
    assert len(root.findall("shape")) == 3, "what is one hole is left out"
    assert [shape.find("bsdf[@type='mask']") is not None for shape in root.findall("shape")] == [True, False, False]
    mask = root.find("shape/bsdf[@type='mask']")
    assert mask is not None and value(mask, "texture/string[@name='filter_type']") == "nearest"
    cut = np.asarray(Image.open(tmp_path / "s-mitsuba" / "opacity-000-0.8-0.4.png"))
    assert cut.shape == (16, 24) and set(np.unique(cut)) == {0, 255}
    alpha = texels[..., 3] / 255.0
    for y, x in rng.integers(0, (16, 24), (80, 2)):
        v, u = (y + 0.5) / 16 * 4 - 0.5, (x + 0.5) / 24 * 6 - 0.5
        near = {(i, j): (1 - abs(v - i)) * (1 - abs(u - j)) for i in range(-1, 5) for j in range(-1, 7)}
        exact = sum(
            weight * alpha[i % 4, j % 6] for (i, j), weight in near.items() if abs(v - i) < 1 and abs(u - j) < 1
        )
        if abs(0.8 * exact - 0.4) > 1e-4:
            assert (cut[y, x] == 255) == (0.8 * exact >= 0.4), (y, x)


def test_alpha_between_texels() -> None:
    fine = alpha_between(np.array([[0, 255]], np.uint8), 2)
    np.testing.assert_allclose(fine, [[0.25, 0.25, 0.75, 0.75]] * 2)
    same = alpha_between(np.array([[0, 255], [51, 102]], np.uint8), 1)
    np.testing.assert_allclose(same, [[0, 1], [0.2, 0.4]], rtol=1e-6)


def test_lamps_shine_from_both_sides_only_where_ours_do(tmp_path: Path) -> None:
    normal = np.tile(np.array([[0, 0, 1]], np.float32), (4, 1))
    made = scene(
        meshes=[triangle(0, normal=normal), triangle(1, normal=normal)],
        materials=[Material(emission=(1, 2, 3)), Material(emission=(4, 5, 6), two_sided=True)],
    )
    root, _ = exported(made, tmp_path)
    shapes = root.findall("shape")
    assert [vector(value(shape, "emitter/rgb")).tolist() for shape in shapes] == [[1, 2, 3], [4, 5, 6], [4, 5, 6]]
    assert all(value(shape, "boolean[@name='face_normals']") == "true" for shape in shapes)
    front, order = read_ply(tmp_path / "s-mitsuba" / "mesh-001.ply")
    back, turned = read_ply(tmp_path / "s-mitsuba" / "mesh-002.ply")

    def facing(columns: dict[str, np.ndarray], faces: np.ndarray) -> np.ndarray:
        corners = np.stack([columns[axis] for axis in "xyz"], axis=1)[faces[0]].astype(np.float64)
        return np.cross(corners[1] - corners[0], corners[2] - corners[0])

    np.testing.assert_allclose(facing(back, turned), -facing(front, order))
    assert (back["z"] < 0).all() and (back["z"] > -1e-4).all(), "behind the front, by a hair"


def test_lights(tmp_path: Path) -> None:
    lights = Lights(
        np.array([[1, 2, 3], [4, 5, 6], [7, 8, 9]], np.float32),
        np.array([[4 * math.pi, 0, 0], [0, 0, 0], [1, 1, 1]], np.float32),
        np.array([[0, 0, 0], [0, 0, 0], [0, 1, 0]], np.float32),
    )
    made = scene(
        suns=[SunLight((0, 0.6, 0.8), (1, 2, 3))],
        points=[PointLight((1, 1, 1), (3, 2, 1))],
        spots=[SpotLight((0, 2, 0), (0, -2, 0), (5, 5, 5), 0.1, 0.5)],
        light_list=lights,
    )
    root, written = exported(made, tmp_path)
    kinds = [found.get("type") for found in root.findall("emitter")]
    assert kinds == ["directional", "point", "spot", "point"], "a black light is left out"
    sun, _, spot, listed = root.findall("emitter")
    direction = sun.find("vector")
    assert direction is not None
    assert [float(direction.get(axis, "")) for axis in "xyz"] == pytest.approx([0, -0.6, -0.8])
    assert vector(value(sun, "rgb")).tolist() == [1, 2, 3]
    assert vector(value(listed, "rgb")).tolist() == pytest.approx([1, 0, 0])
    assert float(value(spot, "float[@name='cutoff_angle']")) == pytest.approx(math.degrees(0.5))
    disc = root.find("shape[@type='disk']")
    assert disc is not None and "1 Lambertian" in written.notes[0]
    radius = float(value(disc, "transform/scale"))
    power = math.pi * math.pi * radius**2 * vector(value(disc, "emitter/rgb"))
    np.testing.assert_allclose(power, [1, 1, 1], rtol=1e-5)


def test_the_ramp_of_a_spot() -> None:
    inner, outer = 0.2, 0.6
    ramp = spot_ramp(inner, outer)
    for y, x in ((256, 256), (256, 400), (100, 300), (10, 256), (0, 0), (500, 30)):
        across = (np.array([x, y]) + 0.5) / 512 * 2 - 1
        angle = math.atan(math.hypot(*across) * math.tan(outer))
        share = (math.cos(angle) - math.cos(outer)) / (math.cos(inner) - math.cos(outer))
        assert ramp[y, x] == pytest.approx(min(max(share, 0), 1) ** 2, abs=1e-5)


def test_too_many_lights_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.mitsuba_scene.emitters.MOST_LIGHTS", 2)
    made = scene(light_list=Lights(np.zeros((3, 3), np.float32), np.ones((3, 3), np.float32)))
    with pytest.raises(LabError, match=r"3 lights; an \.xml holds 2 at most"):
        exported(made, tmp_path)
    assert not files(tmp_path)


def test_nothing_is_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = scene(
        meshes=[triangle(0, uv=np.zeros((4, 2), np.float32))],
        materials=[Material(base_colour=(1, 1, 1), texture=0)],
        textures=[np.zeros((2, 2, 4), np.uint8)],
    )
    exported(made, tmp_path)
    before = {path: (tmp_path / path).read_bytes() for path in files(tmp_path)}

    def fails(*_: object) -> None:
        raise OSError("the disc is full")

    monkeypatch.setattr("lab.mitsuba_scene.surfaces.write_png", fails)
    with pytest.raises(OSError, match="the disc is full"):
        exported(replace(made, cameras=[replace(CAMERA, fov_y_deg=20.0)]), tmp_path)
    assert {path: (tmp_path / path).read_bytes() for path in files(tmp_path)} == before


@pytest.mark.parametrize("name", ["a $b.xml", "a\x01b.xml", "Café, süß & <gut>.xml"])
def test_odd_names(tmp_path: Path, name: str) -> None:
    made = scene()
    written = export_mitsuba(tmp_path / name, made, CAMERA, (8, 8), Params())
    path = value(ElementTree.parse(tmp_path / name).getroot(), "shape/string")
    assert "$" not in path and (tmp_path / path) == written.files[1]


def test_command(quads: Path, empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(quads), "-o", "new/q.xml", "--camera", "side", "--size", "40x20"]) == 0
    said = capsys.readouterr().out
    assert "camera side, 40x20" in said and "wrote new/q.xml and 1 files beside it" in said
    assert files() == ["new/q-mitsuba/mesh-000.ply", "new/q.xml"]
    look = ElementTree.parse("new/q.xml").getroot().find("sensor/transform/lookat")
    assert look is not None and vector(look.get("origin", "")).tolist() == [3, 2, 3]


def test_refusals(quads: Path, empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--size counts only for .xml" in refused(["export", str(quads), "-o", "a.npz", "--size", "8x8"], capsys)
    assert "--camera counts only for .xml" in refused(["export", str(quads), "-o", "a.npz", "--camera", "side"], capsys)
    assert "no camera 'sid'" in refused(["export", str(quads), "-o", "a.xml", "--camera", "sid"], capsys)
    assert main(["export", str(quads), "-o", "a.xml", "--quiet"]) == 0
    own = refused(["export", "a-mitsuba/mesh-000.ply", "-o", "a.xml"], capsys)
    assert "is a file that the scene is read from" in own
