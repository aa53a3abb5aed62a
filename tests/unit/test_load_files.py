"""Files that are missing, empty, cut off or something else, of every ending."""

from __future__ import annotations

from pathlib import Path

import pytest

from lab.errors import LabError
from lab.scene.load import load_scene

from .scene_files import quad_glb

ENDINGS = (".toml", ".glb", ".gltf", ".obj", ".ply")


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
