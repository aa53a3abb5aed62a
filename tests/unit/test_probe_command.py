"""`lab probe`: its tables are the probe's, in any order of the flags, and bad input is refused."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

import lab
from lab.cli import main
from lab.commands.probe_flags import pixel_after_settings

from .command_line import SMALL, files, refused

pytestmark = pytest.mark.usefixtures("empty_folder")


def test_tables(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["probe", str(quads), "16", "12", *SMALL, "--top", "3"]) == 0
    said = capsys.readouterr().out
    probe = lab.probe(lab.load_scene(quads), lab.Params(vpls=200, direct_samples=1), 16, 12, size=(32, 18))
    ranked = probe.lights.sorted()
    assert "quads pixel 16,12" in said and f"{len(ranked)} lights, F = {probe.weight_sum:.4g}" in said
    for i in range(3):
        row = next(line.split() for line in said.splitlines() if line.split()[:1] == [str(ranked.index[i])])
        assert row[1] == str(ranked.level[i]) and row[3] == f"{ranked.blend_weight[i]:.4g}"
        assert f"{ranked.probability[i]:.2%}" in row
    assert said.count("free") + said.count("blocked") + said.count("omega is 0") == 4
    assert not files()


def test_everything_at_once(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--sample", "500", "--exact", "--account", "-o", "new/a.json"]
    assert main(["probe", *SMALL, str(quads), "16", "12", *flags]) == 0
    said = capsys.readouterr().out
    for part in ("drawn 500 times", "p-value", "all-rays value", "sum over all lights", "held by none", "wrote new/a"):
        assert part in said
    record = json.loads(Path("new/a.json").read_text())
    assert sum(record["sample"]["count"]) == 500 and record["exact"]["rays"] > 0
    assert record["account"]["index"] and record["lights"] and files() == ["new/a.json"]
    assert main(["probe", str(quads), "16", "12", *SMALL, "--quiet", "--preset", "paper", "-o", "b.csv"]) == 0
    assert not capsys.readouterr().out
    assert len(list(csv.DictReader(io.StringIO(Path("b.csv").read_text())))) > 10


def test_the_sky(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["probe", str(quads), "0", "0", *SMALL, "--sample", "9", "--exact", "--account"]) == 0
    assert "sees no surface" in capsys.readouterr().out


def test_settings_may_come_first(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = [str(quads), "16", "12"]
    assert main(["probe", *SMALL, *line, "--top", "1"]) == 0
    assert main(["probe", str(quads), *SMALL, "--top", "1", "16", "12"]) == 0
    assert pixel_after_settings(["probe", "--set", "a=1", "b=2", *line, "--top", "1", "--set", "c=3"]) == [
        "probe", "--set", "a=1", "b=2", "--top", "1", "--set", "c=3", "--", *line,
    ]  # fmt: skip
    assert pixel_after_settings(["render", "--set", "a=1", "x"]) == ["render", "--set", "a=1", "x"]


BAD = {
    "outside": (["32", "0"], "x goes from 0 to 31"),
    "below": (["0", "18"], "y from 0 (top) to 17"),
    "a word": (["left", "0"], "X left"),
    "a fraction": (["1", "2.5"], "Y 2.5"),
    "negative": (["-1", "0"], "X -1"),
    "no rows": (["1", "2", "--top", "0"], "--top 0"),
    "no draws": (["1", "2", "--sample", "0"], "--sample 0"),
    "draws of none": (["1", "2", "--sample", "9", "--set", "shadow_samples=0"], "shadow_samples=0"),
    "ending": (["1", "2", "-o", "a.txt"], ".json"),
    "folder": (["1", "2", "-o", "/proc/nowhere/a.csv"], "can't be written"),
    "setting": (["1", "2", "--set", "alhpa=1"], "alpha"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused(quads: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    flags, hint = BAD[name]
    assert hint in refused(["probe", str(quads), *flags, "--size", "32x18"], capsys)


def test_missing_words_and_scenes(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "required: X, Y" in refused(["probe", str(quads)], capsys)
    assert "missing.glb" in refused(["probe", "missing.glb", "0", "0"], capsys)
