"""The command line, run in this process: what each command writes and says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lab.cli import main
from lab.engine.engine import STAGES
from lab.image_io import read_exr, read_exr_attributes
from lab.params import PRESETS, SETTINGS

from .command_line import SMALL, files

pytestmark = pytest.mark.usefixtures("empty_folder")


def rendered(scene: Path, *arguments: str) -> dict:
    assert main(["render", str(scene), "-o", "a", *SMALL, *arguments]) == 0
    return json.loads(Path("a.json").read_text())


def test_render_writes_picture_layers_and_record(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = rendered(quads, "--seed", "7")
    assert files() == ["a.exr", "a.json", "a.png"]
    assert set(record) >= {"params", "preset", "scene", "machine", "version", "load_ms", "counts", "notes"}
    assert list(record["params"]) == list(SETTINGS)
    assert (record["params"]["seed"], record["params"]["vpls"], record["preset"]) == (7, 200, "ours")
    assert list(record["stages_ms"]) == list(STAGES)
    assert record["total_ms"] == pytest.approx(sum(record["stages_ms"].values()), abs=0.01)
    assert record["scene"]["size"] == [32, 18] and record["scene"]["triangles"] == 4
    assert record["scene"]["lights"]["suns"] == 1 and record["scene"]["camera"]["name"] == "front"
    assert record["counts"]["vpls"] == 200 and record["counts"]["paths_launched"] > 0
    said = capsys.readouterr()
    assert "wrote a.png, a.exr, a.json" in said.out and not said.err
    for stage in STAGES:
        assert stage in said.out


def test_record_and_layers_agree(quads: Path) -> None:
    record = rendered(quads)
    layers = read_exr("a.exr")
    assert layers["colour"].shape == (18, 32, 3)
    assert all(np.isfinite(values).all() for values in layers.values())
    seen = layers["depth"] > 0
    assert 0 < seen.sum() < seen.size
    rows = record["counts"]["levels"]
    assert [row["level"] for row in rows] == list(range(len(rows)))
    for row in rows:
        for name in ("overdraw", "lights_used"):
            assert row[f"{name}_mean"] == pytest.approx(layers[f"{name}.L{row['level']}"][seen].mean(), rel=1e-12)
        np.testing.assert_allclose(row["flux"], rows[0]["flux"], rtol=1e-5)
    assert rows[0]["grid_lights"] == 200
    total = sum(layers[f"overdraw.L{row['level']}"].astype(int) for row in rows)
    np.testing.assert_array_equal(layers["overdraw"], total)
    ratio = layers["shadow_ratio"][..., None] if record["params"]["shadow_estimator"] == "ratio" else None
    expected = layers["unshadowed"].astype(float) * ratio * layers["albedo"] / np.pi
    np.testing.assert_allclose(layers["indirect"][seen], expected[seen], rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(layers["colour"], layers["direct"] + layers["indirect"], rtol=1e-5, atol=1e-7)
    attributes = read_exr_attributes("a.exr")
    assert json.loads(attributes["params"]) == record["params"]
    assert attributes["seed"] == "0" and attributes["lab_version"] == record["version"] and attributes["machine"]


def test_threads_and_names_do_not_change_the_layers(quads: Path) -> None:
    made = []
    for name, threads in (("one", "1"), ("two", "2")):
        assert main(["render", str(quads), "-o", name, *SMALL, "--threads", threads, "--quiet"]) == 0
        made.append(Path(f"{name}.exr").read_bytes())
    assert made[0] == made[1]


def test_from_repeats_a_run_bit_for_bit(quads: Path) -> None:
    flags = ["--preset", "paper", "--seed", "3", "--camera", "0,3,3:0,0.5,0", "--sun", "-1,2,1", "--exposure", "1.7"]
    rendered(quads, *flags, "--quiet")
    assert main(["render", "--from", "a.json", "--quiet"]) == 0
    assert main(["render", "--from", "a.json", "-o", "elsewhere/b", "--quiet"]) == 0
    for ending in ("exr", "png"):
        assert Path(f"a-again.{ending}").read_bytes() == Path(f"a.{ending}").read_bytes()
        assert Path(f"elsewhere/b.{ending}").read_bytes() == Path(f"a.{ending}").read_bytes()
    again = json.loads(Path("a-again.json").read_text())
    assert again["preset"] == "paper" and again["scene"]["overrides"]["sun"] == "-1,2,1"


def test_flags_change_a_repeated_run(quads: Path) -> None:
    rendered(quads, "--preset", "paper", "--seed", "3", "--camera", "side", "--quiet")
    assert main(["render", "--from", "a.json", "-o", "b", "--set", "alpha=2", "--size", "8x4", "--quiet"]) == 0
    changed = json.loads(Path("b.json").read_text())
    before = json.loads(Path("a.json").read_text())
    assert changed["params"] == before["params"] | {"alpha": 2.0}
    assert changed["scene"]["size"] == [8, 4] and changed["scene"]["camera"]["name"] == "side"
    assert main(["render", "--from", "a.json", "-o", "c", "--preset", "ours", "--camera", "front", "--quiet"]) == 0
    fresh = json.loads(Path("c.json").read_text())
    assert fresh["params"]["lobe"] == "moments" and fresh["scene"]["camera"]["name"] == "front"


def test_a_record_moved_with_its_scene_still_finds_it(quads: Path) -> None:
    folder = quads.parent
    assert main(["render", str(quads), "-o", str(folder / "a"), *SMALL, "--quiet"]) == 0
    moved = folder.rename(folder.with_name("moved"))
    assert main(["render", "--from", str(moved / "a.json"), "-o", "b", "--quiet"]) == 0
    assert Path("b.exr").read_bytes() == (moved / "a.exr").read_bytes()


def test_output_goes_to_out_by_the_scenes_name(quads: Path) -> None:
    assert main(["render", str(quads), *SMALL, "--quiet"]) == 0
    assert files() == ["out/quads.exr", "out/quads.json", "out/quads.png"]
    assert main(["render", str(quads), *SMALL, "-o", "new/b.png", "--quiet"]) == 0
    assert files(Path("new")) == ["b.exr", "b.json", "b.png"]


def test_heatmap(quads: Path) -> None:
    assert main(["heatmap", str(quads), "-o", "h", *SMALL, "--set", "first_level=1"]) == 0
    assert files() == ["h.exr", "h.json", "h.png"]
    layers = read_exr("h.exr")
    record = json.loads(Path("h.json").read_text())
    drawn = [row for row in record["counts"]["levels"] if row["level"] >= 1]
    assert {name for name in layers if name.startswith("overdraw")} == {
        "overdraw", *(f"overdraw.L{row['level']}" for row in drawn)
    }  # fmt: skip
    assert record["counts"]["overdraw"]["max"] == layers["overdraw"].max()
    assert record["counts"]["overdraw"]["mean"] == pytest.approx(sum(row["overdraw_mean"] for row in drawn), rel=1e-9)
    assert drawn[-1]["overdraw_mean"] == drawn[-1]["grid_lights"], "all lights of the top reach every pixel"
    assert main(["render", str(quads), "-o", "r", *SMALL, "--set", "first_level=1", "--quiet"]) == 0
    np.testing.assert_array_equal(read_exr("r.exr")["overdraw"], layers["overdraw"])


@pytest.mark.parametrize("ending", ["npz", "ply", "vtm"])
def test_export(quads: Path, ending: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(quads), "-o", f"deep/h.{ending}", "--set", "vpls=200"]) == 0
    assert Path(f"deep/h.{ending}").is_file()
    assert "L0 200" in capsys.readouterr().out
    if ending == "npz":
        with np.load("deep/h.npz") as saved:
            assert saved["L0_position"].shape == (200, 3)
            np.testing.assert_allclose(saved["L1_flux"].sum(0), saved["L0_flux"].sum(0), rtol=1e-4)


def test_quiet_says_nothing(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rendered(quads, "--quiet")
    said = capsys.readouterr()
    assert not said.out and not said.err


def test_settings_before_the_scene(quads: Path) -> None:
    assert main(["render", "--size", "4x4", "--quiet", "-o", "a", "--set", "vpls=50", str(quads)]) == 0
    assert json.loads(Path("a.json").read_text())["params"]["vpls"] == 50


def test_one_pixel(quads: Path) -> None:
    assert main(["render", str(quads), "-o", "a", "--size", "1x1", "--set", "vpls=1", "--quiet"]) == 0
    assert read_exr("a.exr")["colour"].shape == (1, 1, 3)
    assert main(["heatmap", str(quads), "-o", "b", "--size", "1x1", "--set", "vpls=1", "--quiet"]) == 0


def test_params_as_json_and_as_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["params", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == list(SETTINGS)
    assert all(set(row["presets"]) == set(PRESETS) for row in rows)
    assert main(["params"]) == 0
    table = capsys.readouterr().out
    assert all(name in table for name in SETTINGS)


def test_info_names_every_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info"]) == 0
    said = capsys.readouterr().out
    for word in ("embree", "threads", "simd", "numpy", "kornia", "pyvista"):
        assert word in said


def test_info_tells_how_to_install_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from importlib import metadata

    real = metadata.version

    def without_torch(name: str) -> str:
        if name == "torch":
            raise metadata.PackageNotFoundError(name)
        return real(name)

    monkeypatch.setattr(metadata, "version", without_torch)
    assert main(["info"]) == 0
    assert "make setup EXTRA=kornia" in capsys.readouterr().out


def test_the_programs_own_entry_points(quads: Path) -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "lab"]
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.startswith("lab ")
    done = subprocess.run(
        [*command, "render", str(quads), "-o", "a", *SMALL], capture_output=True, text=True, check=True, env=environment
    )
    assert "wrote a.png" in done.stdout
    assert not done.stderr, "no progress where nobody watches"
    done = subprocess.run([*command, "render", "x.glb"], capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 2 and "Traceback" not in done.stderr
