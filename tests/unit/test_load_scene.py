"""scene.toml, sidecars, overrides, automatic lights and cameras, bad files of every ending; the shared scenes."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.scene.load import load_scene, override
from lab.scene.sky import SUN_IRRADIANCE

from .scene_files import QUAD, Gltf, ply, quad_glb

ENDINGS = (".toml", ".glb", ".gltf", ".obj", ".ply")
FULL = """
name = "court"
exposure = 1.5
background = [0.1, 0.2, 0.3]
geometry = ["a.glb", "b.ply"]
light_list = "lamps.csv"
[[camera]]
name = "main"
eye = [0, 1, 5]
target = [0, 1, 0]
fov_y_deg = 50
[[camera]]
name = "top"
eye = [0, 9, 0]
target = [0, 0, 0]
up = [0, 0, 1]
[[sun]]
to_sun = [0, 2, 0]
irradiance = [3, 2, 1]
[[point]]
position = [1, 2, 3]
intensity = [4, 5, 6]
[[spot]]
position = [1, 2, 3]
direction = [0, -3, 0]
intensity = [7, 8, 9]
inner_angle_deg = 10
outer_angle_deg = 30
[[material]]
name = "plain"
base_colour = [0.5, 0.4, 0.3]
emission = [20, 18, 15]
two_sided = true
alpha_cutoff = 0.25
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    quad_glb().save(tmp_path / "a.glb")
    (tmp_path / "b.ply").write_bytes(ply(QUAD + np.array([0, 0, 1]), [[0, 1, 2]]))
    (tmp_path / "lamps.csv").write_text("x,y,z,r,g,b\n0,1,0,1,2,3\n")
    (tmp_path / "scene.toml").write_text(FULL)
    return tmp_path


def test_full_toml(folder: Path) -> None:
    scene = load_scene(folder)
    assert (scene.name, scene.exposure, scene.background) == ("court", 1.5, (0.1, 0.2, 0.3))
    assert [camera.name for camera in scene.cameras] == ["main", "top"]
    assert scene.cameras[0].fov_y_deg == 50 and scene.cameras[1].up == (0, 0, 1)
    assert scene.suns[0].to_sun == (0, 1, 0) and scene.suns[0].irradiance == (3, 2, 1)
    assert scene.points[0].intensity == (4, 5, 6)
    assert scene.spots[0].direction == (0, -1, 0)
    assert scene.spots[0].outer_angle == pytest.approx(math.pi / 6)
    assert scene.light_list is not None
    np.testing.assert_allclose(scene.light_list.flux, [[4 * math.pi, 8 * math.pi, 12 * math.pi]], rtol=1e-6)
    plain, default = scene.materials
    assert plain.emission == (20, 18, 15) and plain.two_sided and plain.alpha_cutoff == 0.25
    assert default.emission == (0, 0, 0)
    assert [mesh.material for mesh in scene.meshes] == [0, 1] and scene.triangles == 3
    assert scene.path.endswith("scene.toml")


def test_geometry_files_bring_textures_cameras_and_lights(tmp_path: Path) -> None:
    for name, shade in (("a", 10), ("b", 200)):
        gltf = Gltf()
        texture = gltf.texture(np.full((1, 1, 4), shade, dtype=np.uint8))
        info = {"baseColorTexture": {"index": texture}}
        gltf.node(mesh=gltf.mesh(material=gltf.material(name=name, pbrMetallicRoughness=info)))
        gltf.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
        gltf.node(camera=0, name=f"eye of {name}", translation=[0, 0, 4])
        gltf.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
        gltf.node(extensions={"KHR_lights_punctual": {"light": 0}})
        gltf.save(tmp_path / f"{name}.glb")
    (tmp_path / "scene.toml").write_text('geometry = ["a.glb", "b.glb"]\n')
    scene = load_scene(tmp_path)
    shades = [scene.textures[scene.materials[mesh.material].texture][0, 0, 0] for mesh in scene.meshes]
    assert shades == [10, 200]
    assert [camera.name for camera in scene.cameras] == ["eye of a", "eye of b"] and len(scene.points) == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("exposure = 1.5", "exposre = 1.5", "unknown key 'exposre'; did you mean 'exposure'"),
        ("exposure = 1.5", "exposure = 0", "exposure is 0.*over 0"),
        ("exposure = 1.5", 'exposure = "x"', "exposure is 'x'"),
        ("exposure = 1.5", "exposure = true", "exposure is True"),
        ("exposure = 1.5", "exposure = inf", "exposure is inf"),
        ("[0.1, 0.2, 0.3]", "[0.1, 0.2]", "background is .* three finite numbers"),
        ('["a.glb", "b.ply"]', '"a.glb"', "must be a list of files"),
        ('["a.glb", "b.ply"]', '["nothing.glb"]', "nothing.glb: there is no such file"),
        ('["a.glb", "b.ply"]', '["scene.toml"]', "geometry is read from"),
        ('geometry = ["a.glb", "b.ply"]', "", "'geometry' is missing"),
        ("lamps.csv", "lamps.xyz", "a light list ends in"),
        ("lamps.csv", "gone.csv", "no such file"),
        ("target = [0, 1, 0]", "target = [0, 1, 5]", "camera 1: .*eye and target must differ"),
        ("fov_y_deg = 50", "fov_y_deg = 200", "under 180 degrees"),
        ("fov_y_deg = 50", "fov = 50", "unknown key 'fov'; did you mean 'fov_y_deg'"),
        ('name = "top"', 'name = "main"', "camera 'main' already"),
        ("to_sun = [0, 2, 0]", "to_sun = [0, 0, 0]", "to_sun is .*needs a length"),
        ("to_sun = [0, 2, 0]", "", "'to_sun' is missing"),
        ("irradiance = [3, 2, 1]", "irradiance = [3, -2, 1]", "irradiance is .* from 0"),
        ("outer_angle_deg = 30", "outer_angle_deg = 5", "inner_angle_deg is 10"),
        ('name = "plain"', 'name = "plane"', "no material 'plane'; did you mean 'plain'"),
        ("base_colour = [0.5, 0.4, 0.3]", "base_colour = [5, 4, 3]", "up to 1"),
        ("two_sided = true", 'two_sided = "yes"', "true or false"),
        ("[[sun]]", "[sun]", "must be a list of tables"),
        ("exposure = 1.5", "exposure = 1.5.2", r"not valid TOML.*line 3.*'exposure = 1\.5\.2'"),
        ("[[spot]]", "[[spot", "not valid TOML"),
    ],
)
def test_bad_toml(folder: Path, old: str, new: str, message: str) -> None:
    assert old in FULL
    (folder / "scene.toml").write_text(FULL.replace(old, new, 1))
    with pytest.raises(LabError, match=message) as caught:
        load_scene(folder)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("light", ["", "[[sun]]\nto_sun = [0, 1, 0]\nirradiance = [0, 0, 0]\n"])
def test_toml_without_light_is_an_error(folder: Path, light: str) -> None:
    (folder / "scene.toml").write_text('geometry = ["a.glb"]\n' + light)
    with pytest.raises(LabError, match="the scene has no light"):
        load_scene(folder)


def test_toml_takes_no_sidecar(folder: Path) -> None:
    (folder / "a.json").write_text(json.dumps({"sun_direction_to_sun": [0, 1, 0]}))
    (folder / "scene.toml").write_text('geometry = ["a.glb"]\n[[point]]\nposition=[0,1,0]\nintensity=[1,1,1]\n')
    scene = load_scene(folder)
    assert scene.suns == [] and scene.name == folder.name


def test_sidecar(tmp_path: Path) -> None:
    path = quad_glb().save(tmp_path / "a.glb")
    (tmp_path / "a.json").write_text(json.dumps({
        "title": "anything",
        "cameras": [{"name": "main", "eye": [0, 0, 3], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y_deg": 30,
                     "fov_x_deg": 50, "aspect": "16:9"}],
        "sun_direction_to_sun": [0, 5, 0],
        "emitters": [{"material": "plain", "radiance": [1, 2, 3], "bbox": [[0, 0, 0], [1, 1, 1]]}],
        "suggested_lights": [{"type": "point", "position": [0, 1, 0], "intensity": [4, 4, 4]}],
    }))  # fmt: skip
    scene = load_scene(path)
    assert scene.cameras[0].name == "main" and scene.cameras[0].fov_y_deg == 30 and len(scene.cameras) == 1
    assert scene.suns[0].to_sun == (0, 1, 0) and scene.suns[0].irradiance == SUN_IRRADIANCE
    assert scene.materials[0].emission == (1, 2, 3) and scene.points[0].intensity == (4, 4, 4)
    assert scene.notes == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"cameras": 5}', "cameras is 5"),
        ('{"cameras": [{"name": "x"}]}', "cameras 1: the key 'eye' is missing"),
        ('{"emitters": [{"material": "plane", "radiance": [1, 1, 1]}]}', "did you mean 'plain'"),
        ('{"sun_direction_to_sun": [1, 2]}', "sun_direction_to_sun is"),
        ('{"suggested_lights": [{"type": "disco"}]}', "sun, point or spot"),
        ("[1]", "holds a list"),
        ("{", "not valid JSON"),
        ("[" * 100_000, "nested too deeply"),
    ],
)
def test_bad_sidecar(tmp_path: Path, text: str, message: str) -> None:
    path = quad_glb().save(tmp_path / "a.glb")
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(LabError, match=message) as caught:
        load_scene(path)
    assert "a.json" in str(caught.value)


def test_bare_mesh_gets_sun_and_camera_and_says_so(tmp_path: Path) -> None:
    scene = load_scene(quad_glb().save(tmp_path / "a.glb"))
    assert len(scene.suns) == 1 and scene.suns[0].irradiance == SUN_IRRADIANCE and scene.exposure == 1
    assert any("sun was put in" in note for note in scene.notes)
    assert any("no camera" in note for note in scene.notes)


def box(gltf: Gltf, low: tuple[float, ...], high: tuple[float, ...], inward: bool = False) -> None:
    """A box of 12 triangles, seen from outside or from within."""
    p = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)], dtype=np.float32)
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))], dtype=np.uint16)
    gltf.node(mesh=gltf.mesh(faces[:, ::-1].copy() if inward else faces, POSITION=p))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_camera_outside_an_object_sees_all_of_it(tmp_path: Path, scale: float) -> None:
    gltf = Gltf()
    box(gltf, (0, 0, 0), (2 * scale, scale, scale))
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    camera = scene.cameras[0]
    low, high = scene.bounds
    corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])
    forward = np.subtract(camera.target, camera.eye) / np.linalg.norm(np.subtract(camera.target, camera.eye))
    away = corners - camera.eye
    angle = np.degrees(np.arccos(away @ forward / np.linalg.norm(away, axis=1)))
    assert (angle < camera.fov_y_deg / 2).all() and angle.max() > camera.fov_y_deg / 5


def test_camera_stands_inside_a_room_and_looks_along_it(tmp_path: Path) -> None:
    gltf = Gltf()
    box(gltf, (0, 0, 0), (12, 3, 5), inward=True)
    box(gltf, (9, 0, 2), (10, 1, 3))
    camera = load_scene(gltf.save(tmp_path / "a.glb")).cameras[0]
    assert all(low < v < high for v, low, high in zip(camera.eye, (0, 0, 0), (12, 3, 5), strict=True))
    view = np.subtract(camera.target, camera.eye)
    assert abs(view[0]) > abs(view[2]) and abs(view[1]) < 0.2 * abs(view[0])


def test_camera_looks_into_an_open_box(tmp_path: Path) -> None:
    gltf = Gltf()
    box(gltf, (0, 0, 0), (4, 4, 4), inward=True)
    faces = gltf.json["accessors"][-1]
    faces["count"] -= 6  # without the last two triangles, the wall at z = 4
    camera = load_scene(gltf.save(tmp_path / "a.glb")).cameras[0]
    assert camera.eye[2] > 4 and camera.eye[0] == pytest.approx(2, abs=0.5)


def test_far_from_the_origin_and_degenerate_triangles(tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(np.array([0, 1, 2, 0, 0, 1, 3, 3, 3], dtype=np.uint8)), translation=[1e5, -1e5, 1e5])
    scene = load_scene(gltf.save(tmp_path / "a.glb"))
    assert scene.triangles == 3 and np.isfinite(scene.cameras[0].eye).all()


def test_override(folder: Path) -> None:
    scene = load_scene(folder)
    assert override(scene) is scene
    assert [camera.name for camera in override(scene, camera="top").cameras] == ["top", "main"]
    first = override(scene, camera="1,2,3:4,5,6.5:0,0,1:30").cameras[0]
    assert (first.eye, first.target, first.up, first.fov_y_deg) == ((1, 2, 3), (4, 5, 6.5), (0, 0, 1), 30)
    assert override(scene, camera="1,2,3:4,5,6").cameras[0].up == (0, 1, 0)
    sun = override(scene, sun="0,0,4").suns
    assert len(sun) == 1 and sun[0].to_sun == (0, 0, 1) and sun[0].irradiance == (3, 2, 1)
    assert override(scene, exposure=0.5).exposure == 0.5
    assert len(scene.cameras) == 2 and scene.exposure == 1.5  # the scene given is left as it is


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"camera": "mian"}, "did you mean 'main'"),
        ({"camera": "1,2:3,4,5"}, "'1,2' is not three numbers"),
        ({"camera": "1,2,3:1,2,3"}, "eye and target must differ"),
        ({"camera": "1,2,3:1,2,4:0,1,0:wide"}, "'wide' is no number"),
        ({"camera": "1,2,3:1,2,4:0,1,0:30:5"}, "has 5 parts"),
        ({"camera": "1,2,nan:1,2,4"}, "finite"),
        ({"sun": "up"}, "not three numbers"),
        ({"sun": "0,0,0"}, "needs a length"),
        ({"exposure": 0.0}, "exposure is 0"),
        ({"exposure": math.nan}, "exposure is nan"),
    ],
)
def test_bad_override(folder: Path, given: dict[str, object], message: str) -> None:
    with pytest.raises(LabError, match=message):
        override(load_scene(folder), **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("ending", ENDINGS)
def test_missing_empty_and_folder(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    with pytest.raises(LabError, match="no such file"):
        load_scene(path)
    path.write_bytes(b"")
    with pytest.raises(LabError, match="is empty"):
        load_scene(path)
    (tmp_path / f"folder{ending}").mkdir()
    with pytest.raises(LabError, match="folder"):
        load_scene(tmp_path / f"folder{ending}")


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("data", [b"hello, this is a text\n" * 9, b"\x89PNG\r\n\x1a\n" + bytes(range(256))])
def test_something_else_under_the_name(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], ending: str, data: bytes
) -> None:
    (tmp_path / f"a{ending}").write_bytes(data)
    with pytest.raises(LabError, match="a" + ending):
        load_scene(tmp_path / f"a{ending}")
    assert capfd.readouterr() == ("", "")


def test_unknown_ending_names_the_known_ones(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").write_bytes(b"x")
    with pytest.raises(LabError, match=r"'\.fbx'.*\.toml, \.glb, \.gltf, \.obj, \.ply"):
        load_scene(tmp_path / "a.fbx")


def test_glb_cut_off_anywhere(tmp_path: Path) -> None:
    whole = quad_glb().bytes()
    for length in range(0, len(whole), 7):
        (tmp_path / "a.glb").write_bytes(whole[:length])
        with pytest.raises(LabError, match=r"a\.glb"):
            load_scene(tmp_path / "a.glb")


def test_shared_scenes(shared_scenes: Path) -> None:
    names = ["breakfast_room", "cornell_box", "living_room", "modern_hall", "sponza"]
    for name in names:
        told = json.loads((shared_scenes / f"{name}.json").read_text())
        scene = load_scene(shared_scenes / f"{name}.glb")
        assert scene.triangles == told["triangles"]
        assert len(scene.materials) == told["materials"] and len(scene.textures) == told["textures"]
        np.testing.assert_allclose(scene.bounds, told["bbox"], atol=1e-3)
        assert [camera.name for camera in scene.cameras] == [camera["name"] for camera in told["cameras"]]
        assert len(scene.suns) == (0 if told["sun_direction_to_sun"] is None and told["emitters"] else 1)
        lit = {m.name: m.emission for m in scene.materials if max(m.emission) > 0}
        assert lit == {e["material"]: pytest.approx(tuple(e["radiance"])) for e in told["emitters"]}
        holes = {m.name for m in scene.materials if m.alpha_cutoff > 0}
        assert holes == {*told["mask_materials"], *told["blend_materials"]}
        for mesh in scene.meshes:
            assert mesh.index.max() < len(mesh.position) and np.isfinite(mesh.position).all()
            np.testing.assert_allclose(np.linalg.norm(mesh.normal.astype(float), axis=1), 1, atol=1e-5)
    masked = [scene.textures[m.texture] for m in scene.materials if m.alpha_cutoff > 0]
    assert len(masked) == 3 and all(texture[..., 3].min() == 0 for texture in masked)


def test_shared_scenes_agree_with_open3d(shared_scenes: Path) -> None:
    """An outside reader: open3d groups the triangles otherwise, but the surface it finds is the same."""
    import open3d

    for name in ("cornell_box", "sponza"):
        scene = load_scene(shared_scenes / f"{name}.glb")
        model = open3d.io.read_triangle_model(shared_scenes / f"{name}.glb")
        corners = np.concatenate([np.asarray(m.mesh.vertices)[np.asarray(m.mesh.triangles)] for m in model.meshes])
        ours = np.concatenate([mesh.position[mesh.index] for mesh in scene.meshes]).astype(float)
        assert len(ours) == len(corners)
        for moment in (1, 2):
            np.testing.assert_allclose((ours**moment).sum(axis=(0, 1)), (corners**moment).sum(axis=(0, 1)), rtol=1e-6)


def test_shared_scenes_without_their_sidecars(shared_scenes: Path, tmp_path: Path) -> None:
    for name in ("breakfast_room", "living_room", "modern_hall", "sponza"):
        shutil.copy(shared_scenes / f"{name}.glb", tmp_path)
        scene = load_scene(tmp_path / f"{name}.glb")
        low, high = scene.bounds
        (camera,) = scene.cameras
        assert (low < camera.eye).all() and (camera.eye < high).all(), name
        assert any("a room, seen from within" in note for note in scene.notes)
    shutil.copy(shared_scenes / "cornell_box.glb", tmp_path)
    camera = load_scene(tmp_path / "cornell_box.glb").cameras[0]
    assert camera.eye[2] < 0 and camera.target[2] > camera.eye[2]  # through the missing wall
