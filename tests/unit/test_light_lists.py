"""The user's own light lists: the three formats, their units, and every way to get a column wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.errors import LabError
from lab.records import Lights
from lab.scene.lights import load_light_list, save_light_list

from .scene_files import ply

POSITION = np.array([[0, 1, 2], [3, 4, 5.5]])
INTENSITY = np.array([[1, 0.5, 0], [2, 3, 4]])
NORMAL = np.array([[0, 3, 0], [0, 0, 0]])


def write(path: Path, normal: bool) -> Path:
    if path.suffix == ".npz":
        np.savez(path, position=POSITION, intensity=INTENSITY, **({"normal": NORMAL} if normal else {}))
    elif path.suffix == ".csv":
        rows = np.hstack([POSITION, INTENSITY, NORMAL]) if normal else np.hstack([POSITION, INTENSITY])
        head = "x,y,z,r,g,b,nx,ny,nz" if normal else "x,y,z,r,g,b"
        path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    else:
        extra = "float red,float green,float blue" + (",float nx,float ny,float nz" if normal else "")
        rows = np.hstack([POSITION, INTENSITY, NORMAL]) if normal else np.hstack([POSITION, INTENSITY])
        path.write_bytes(ply(rows, None, "binary_little_endian", extra))
    return path


@pytest.mark.parametrize("ending", [".npz", ".csv", ".ply"])
@pytest.mark.parametrize("normal", [False, True])
def test_units(tmp_path: Path, ending: str, normal: bool) -> None:
    lights = load_light_list(write(tmp_path / f"a{ending}", normal))
    np.testing.assert_allclose(lights.position, POSITION)
    factor = np.array([[np.pi], [4 * np.pi]]) if normal else 4 * np.pi  # the second normal is (0, 0, 0): isotropic
    np.testing.assert_allclose(lights.flux, INTENSITY * factor, rtol=1e-6)
    np.testing.assert_allclose(lights.normal, [[0, 1, 0], [0, 0, 0]] if normal else np.zeros((2, 3)))
    assert lights.paths_launched == 0


def test_ply_byte_colours_count_from_0_to_1(tmp_path: Path) -> None:
    for kind, top in (("uchar", 255), ("ushort", 65535)):
        extra = f"{kind} red,{kind} green,{kind} blue"
        rows = np.hstack([POSITION, np.tile([top, 0, top // 5], (2, 1))])
        (tmp_path / "a.ply").write_bytes(ply(rows, None, "ascii", extra))
        lights = load_light_list(tmp_path / "a.ply")
        np.testing.assert_allclose(lights.flux, np.tile([4 * np.pi, 0, 0.8 * np.pi], (2, 1)), rtol=1e-5)


def test_csv_columns_in_any_order_with_comments(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("# lamps\nR,G,B,X,Y,Z\n\n1,2,3,4,5,6\n")
    lights = load_light_list(tmp_path / "a.csv")
    np.testing.assert_allclose(lights.position, [[4, 5, 6]])
    np.testing.assert_allclose(lights.flux, [[4 * np.pi, 8 * np.pi, 12 * np.pi]], rtol=1e-6)


def test_save_and_load_agree(tmp_path: Path) -> None:
    for normal in (None, np.float32([[0, 1, 0], [0, 0, 0]])):
        lights = Lights(np.float32(POSITION), np.float32(INTENSITY), normal)
        save_light_list(tmp_path / "a.npz", lights)
        back = load_light_list(tmp_path / "a.npz")
        np.testing.assert_array_equal(back.position, lights.position)
        np.testing.assert_allclose(back.flux, lights.flux, rtol=3e-7)
        np.testing.assert_array_equal(back.normal, lights.normal)
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]
    with pytest.raises(LabError, match=r"written as \.npz"):
        save_light_list(tmp_path / "a.csv", lights)
    with pytest.raises(LabError, match="cannot be written"):
        save_light_list(tmp_path / "nowhere" / "a.npz", lights)


GOOD = {"position": POSITION, "intensity": INTENSITY}


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"position": POSITION}, "'intensity' is missing"),
        ({**GOOD, "normals": NORMAL}, "unknown array 'normals'; did you mean 'normal'"),
        ({**GOOD, "intensity": INTENSITY[:1]}, "2 positions but 1 rows"),
        ({**GOOD, "intensity": INTENSITY[:, :2]}, r"shape \(2, 2\)"),
        ({**GOOD, "intensity": INTENSITY[:, 0]}, r"shape \(2,\)"),
        ({**GOOD, "intensity": -INTENSITY}, r"light 0 has intensity \[-1"),
        ({**GOOD, "intensity": INTENSITY * 1e38}, "light 0 has intensity|light 1 has intensity"),
        ({**GOOD, "position": POSITION * [[1], [np.nan]]}, "light 1 has position"),
        ({**GOOD, "position": POSITION + np.array([[0], [np.inf]])}, "light 1 has position"),
        ({**GOOD, "position": np.array([["a"] * 3] * 2)}, "numbers were expected"),
        ({**GOOD, "position": np.array([[None] * 3] * 2)}, "holds objects"),
        ({"position": np.zeros((0, 3)), "intensity": np.zeros((0, 3))}, "holds no lights"),
    ],
)
def test_bad_npz(tmp_path: Path, arrays: dict[str, np.ndarray], message: str) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(LabError, match=message):
        load_light_list(tmp_path / "a.npz")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x,y,z,r,g\n1,2,3,4,5\n", "column 'b' is missing"),
        ("x,y,z,r,g,b,nx\n1,2,3,4,5,6,7\n", "of nx ny nz only nx"),
        ("x,y,z,r,g,b,a\n1,2,3,4,5,6,7\n", "unknown column 'a'"),
        ("x,y,z,r,g,b,b\n1,2,3,4,5,6,7\n", "there twice"),
        ("1,2,3,4,5,6\n", "column 'x' is missing"),
        ("x,y,z,r,g,b\n", "holds no lights"),
        ("\n", "is empty"),
        ("x,y,z,r,g,b\n1,2,3,4,5\n", "line 2: 5 values for 6 columns"),
        ("x,y,z,r,g,b\n1,2,3,4,5,6\n1,2,3,4,5,red\n", "line 3: could not convert"),
        ("x,y,z,r,g,b\n1,2,3,4,5,nan\n", "light 0 has intensity"),
        ("x,y,z,r,g,b\n1,2,3,4,5,-6\n", "0 or more"),
    ],
)
def test_bad_csv(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(LabError, match=message):
        load_light_list(tmp_path / "a.csv")


def test_bad_ply(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rows = np.hstack([POSITION, INTENSITY])
    colours = "float red,float green,float blue"
    broken = rows.copy()
    broken[1, 4] = np.nan
    cases = {
        "column 'red' is missing": ply(POSITION, None),
        "unknown column 'alpha'": ply(np.hstack([rows, rows[:, :1]]), None, extra=colours + ",float alpha"),
        "mesh with 1 faces": ply(np.vstack([rows, rows]), [[0, 1, 2]], extra=colours),
        "vertex 1 holds a number that is not finite": ply(broken, None, extra=colours),
        "of one type": ply(rows, None, extra="float red,float green,uchar blue"),
        "no vertices": ply(rows[:0], None, extra=colours),
        "cut off": ply(rows, None, "binary_little_endian", extra=colours)[:-3],
        "0 or more": ply(-rows, None, extra=colours),
    }
    for message, data in cases.items():
        (tmp_path / "a.ply").write_bytes(data)
        with pytest.raises(LabError, match=message):
            load_light_list(tmp_path / "a.ply")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", [".npz", ".csv", ".ply", ".txt"])
def test_no_list_at_all(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    with pytest.raises(LabError, match=r"no such file|ends in"):
        load_light_list(path)
    path.write_bytes(b"")
    with pytest.raises(LabError, match=r"is empty|ends in"):
        load_light_list(path)
    path.write_bytes(b"PK\x03\x04 nothing\xff")
    with pytest.raises(LabError, match=r"a\."):
        load_light_list(path)
