"""scene.toml, the JSON beside a file, the command line's overrides, the automatic sun."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.scene.load import load_scene, override
from lab.scene.sky import SUN_IRRADIANCE

from .scene_files import QUAD, Gltf, ply, quad_glb

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
    assert len(scene.suns) == 1 and scene.suns[0].irradiance == SUN_IRRADIANCE and scene.exposure is None
    assert any("sun was put in" in note for note in scene.notes)
    assert any("no camera" in note for note in scene.notes)


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
