"""``lab reference``: its files and words, going on, Ctrl-C, and what it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from lab.cli import main
from lab.commands.reference import LAYERS
from lab.engine.cpu import CpuEngine
from lab.image_io import read_exr, read_exr_attributes
from lab.params import Params
from lab.reference import Budget, brute_force, path_traced
from lab.scene.load import load_scene

from .command_line import files, refused

SIZE = ["--size", "32x18"]


@pytest.fixture(autouse=True)
def cache_folder(empty_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def referred(scene: Path, *arguments: str) -> dict:
    assert main(["reference", str(scene), "-o", "a", *SIZE, *arguments]) == 0
    return json.loads(Path("a.json").read_text())


@pytest.mark.parametrize("method", ["path_tracer", "brute_force"])
def test_it_writes_layers_with_their_variances(quads: Path, method: str, capsys: pytest.CaptureFixture[str]) -> None:
    record = referred(quads, "--method", method, "--spp", "16", "--seed", "3", "--set", "vpls=300")
    assert files() == ["a.exr", "a.json", "a.png"]
    layers = read_exr("a.exr")
    assert set(layers) == set(LAYERS)
    scene = load_scene(quads)
    engine = CpuEngine(scene)
    function = path_traced if method == "path_tracer" else brute_force
    wanted = function(engine, scene.camera(), (32, 18), Params(vpls=300, seed=3), budget=Budget(spp=16))
    for name in LAYERS[1:]:
        np.testing.assert_allclose(layers[name], getattr(wanted, name).astype(np.float32), rtol=1e-6)
    np.testing.assert_allclose(layers["colour"], layers["direct"] + layers["indirect"], rtol=1e-6)
    assert layers["indirect_variance"].any() and layers["indirect"].any()
    assert (record["method"], record["samples"], record["reused_samples"]) == (method, 16, 0)
    assert record["relative_error"] == pytest.approx(wanted.relative_error)
    assert record["settings"]["seed"] == 3 and ("vpls" in record["settings"]) == (method == "brute_force")
    assert record["scene"]["size"] == [32, 18] and record["pixel"] == "centre" and not record["exact"]
    attributes = read_exr_attributes("a.exr")
    assert (attributes["method"], attributes["samples"]) == (method, "16")
    said = capsys.readouterr()
    assert method in said.out and "wrote a.png, a.exr, a.json" in said.out and "reused" not in said.out
    assert not said.err


def test_the_background_is_seen_as_in_a_frame(quads: Path) -> None:
    text = quads.read_text().replace("exposure = 1.0", "exposure = 1.0\nbackground = [0.2, 0.4, 0.8]")
    quads.write_text(text)
    referred(quads, "--spp", "4")
    assert main(["render", str(quads), "-o", "frame", *SIZE, "--set", "vpls=300"]) == 0
    found, frame = read_exr("a.exr"), read_exr("frame.exr")
    unseen = frame["depth"] == 0
    assert unseen.any()
    np.testing.assert_array_equal(found["colour"][unseen], frame["colour"][unseen])
    np.testing.assert_allclose(found["direct"], frame["direct"], rtol=1e-5)


def test_more_samples_go_on(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    referred(quads, "--spp", "16")
    capsys.readouterr()
    record = referred(quads, "--spp", "48")
    assert (record["samples"], record["reused_samples"]) == (48, 16)
    assert "reused 16 of 48 samples from an earlier run" in capsys.readouterr().out
    both = Path("a.exr").read_bytes()
    record = referred(quads, "--spp", "48", "--no-cache")
    assert record["reused_samples"] == 0
    assert Path("a.exr").read_bytes() == both


def test_what_is_kept_is_the_default_methods_own(quads: Path, cache_folder: Path) -> None:
    referred(quads, "--spp", "4", "--no-cache", "--quiet")
    assert not cache_folder.exists()
    referred(quads, "--spp", "4", "--quiet")
    referred(quads, "--spp", "4", "--quiet", "--set", "alpha=2", "filter=none")
    assert len(files(cache_folder)) == 1, "settings that don't count don't part references"
    referred(quads, "--spp", "4", "--pixel", "area")
    referred(quads, "--spp", "4", "--sun", "1,1,0")
    referred(quads, "--spp", "4", "--camera", "side")
    assert len(files(cache_folder)) == 4


def test_quiet_says_nothing(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    referred(quads, "--spp", "2", "--quiet")
    said = capsys.readouterr()
    assert not said.out and not said.err


def test_one_sample_is_strict_json(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert referred(quads, "--spp", "1")["relative_error"] is None
    assert "no error bar" in capsys.readouterr().out


def test_of_a_frame(quads: Path) -> None:
    """--from takes scene, size, view and settings of an earlier frame."""
    view = ["--camera", "side", "--size", "20x10", "--set", "vpls=300", "max_bounces=1"]
    assert main(["render", str(quads), "-o", "out/frame", *view, "--quiet"]) == 0
    assert main(["reference", "--from", "out/frame.json", "--spp", "4"]) == 0
    assert {f"out/frame-reference{ending}" for ending in (".png", ".exr", ".json")} <= set(files())
    record = json.loads(Path("out/frame-reference.json").read_text())
    assert record["scene"]["size"] == [20, 10] and record["params"]["max_bounces"] == 1
    assert record["scene"]["camera"] == json.loads(Path("out/frame.json").read_text())["scene"]["camera"]


def test_its_usual_name(quads: Path) -> None:
    assert main(["reference", str(quads), *SIZE, "--spp", "2", "--quiet"]) == 0
    assert files() == [f"out/quads-reference{ending}" for ending in (".exr", ".json", ".png")]


@pytest.mark.parametrize(
    ("flag", "value"), [("--time", "0.2"), ("--time", "0.005m"), ("--error", "0.9"), ("--error", "90%")]
)
def test_by_time_and_by_error(quads: Path, flag: str, value: str) -> None:
    record = referred(quads, flag, value)
    assert record["samples"] > 0
    if flag == "--error":
        assert record["relative_error"] <= 0.9


def test_ctrl_c_keeps_what_was_reached(
    quads: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    calls = 0
    original = CpuEngine.trace_paths

    def stopped(*arguments: object, **named: object) -> object:
        nonlocal calls
        calls += 1
        if calls == 3:
            raise KeyboardInterrupt
        return original(*arguments, **named)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(CpuEngine, "trace_paths", stopped)
        assert main(["reference", str(quads), "-o", "a", *SIZE, "--spp", "64"]) == 130
    said = capsys.readouterr().err
    assert re.search(r"32 samples a pixel.* kept in .*cache.*run the same command again to go on", said)
    assert said.endswith("lab: interrupted\n") and "Traceback" not in said
    assert files() == []
    assert referred(quads, "--spp", "64")["reused_samples"] == 32


def test_ctrl_c_without_the_cache(
    quads: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(CpuEngine, "trace_paths", stopped)
    assert main(["reference", str(quads), *SIZE, "--no-cache"]) == 130
    assert capsys.readouterr().err == "lab: interrupted\n"


BAD_FLAGS = {
    "method": (["--method", "path"], "path_tracer"),
    "pixel": (["--pixel", "center"], "centre"),
    "area lights": (["--method", "brute_force", "--pixel", "area"], "--pixel area"),
    "no samples": (["--spp", "0"], "--spp 0"),
    "samples of words": (["--spp", "many"], "--spp many"),
    "samples in part": (["--spp", "1.5"], "--spp 1.5"),
    "too many samples": (["--spp", "1" * 5000], "--spp"),
    "error zero": (["--error", "0"], "--error 0"),
    "error infinite": (["--error", "inf"], "--error inf"),
    "error of words": (["--error", "small"], "0.01"),
    "error of two numbers": (["--error", "1.2.3"], "--error 1.2.3"),
    "time zero": (["--time", "0s"], "--time 0s"),
    "time of words": (["--time", "1 day"], "90s"),
    "setting": (["--set", "alhpa=1"], "alpha"),
    "engine": (["--engine", "gpu"], "cpu"),
    "compensation of nothing": (["--no-cache", "--size", "0x1"], "--size"),
    "camera": (["--camera", "frnt"], "front"),
}


@pytest.mark.parametrize("name", BAD_FLAGS)
def test_bad_flags_are_refused(quads: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    flags, hint = BAD_FLAGS[name]
    assert hint in refused(["reference", str(quads), "-o", "new/a", *flags], capsys)
    assert not Path("new").exists()


def test_no_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert "lab reference scenes" in refused(["reference"], capsys)


def test_a_cache_that_can_not_be_written(
    quads: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "file"))
    assert "--no-cache" in refused(["reference", str(quads), "-o", "a", *SIZE], capsys)


def test_a_failure_writes_nothing(
    quads: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr("lab.image_io.write_exr", broken)
    assert main(["reference", str(quads), "-o", "a", *SIZE, "--spp", "2"]) == 1
    assert "the disk is full" in capsys.readouterr().err
    assert files() == []
