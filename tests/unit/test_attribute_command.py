"""``lab attribute``: its table, its page and its record, and what it refuses."""

from __future__ import annotations

import base64
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lab.attribute import pictures
from lab.attribute.terms import TERMS
from lab.cli import main
from lab.error_picture import SIGNED
from lab.params import PRESETS

from .command_line import files, refused

SMALL = ["--size", "24x14", "--set", "vpls=200", "direct_samples=1"]


@pytest.fixture(autouse=True)
def cache_folder(empty_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LAB_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


class Page(HTMLParser):
    """What a page holds; fails on tags that are not closed in order."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[str] = []
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "img":
            self.images.append(values["src"] or "")
        if "id" in values:
            self.ids.add(values["id"] or "")
        if "href" in values:
            self.links.append(values["href"] or "")
        assert tag not in ("script", "link", "iframe")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def decoded(uri: str) -> np.ndarray:
    kind, data = uri.split(",", 1)
    assert kind == "data:image/png;base64"
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))


def test_table_page_and_record(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["attribute", str(quads), "-o", "budget", *SMALL]) == 0
    assert files() == ["budget/attribution.json", "budget/index.html"]
    said = capsys.readouterr()
    assert not said.err and "wrote budget/index.html, budget/attribution.json" in said.out
    assert all(len(line) <= 200 for line in said.out.splitlines())
    record = json.loads(Path("budget/attribution.json").read_text(), parse_constant=pytest.fail)
    assert [t["name"] for t in record["terms"] if t["name"] != "hierarchy_shadows"] == [t.name for t in TERMS]
    assert {p["name"] for p in record["presets"]} == set(PRESETS)
    assert [p["rel_mse"] for p in record["presets"]] == sorted(p["rel_mse"] for p in record["presets"])
    assert record["params"]["vpls"] == 200 and record["scene"]["size"] == [24, 14] and record["preset"] == "ours"
    assert record["truth"]["method"] == "path_tracer" and record["truth"]["samples"] == record["effort"]["paths"]
    for term in record["terms"]:
        for side in (term["on_alone"], term["off_alone"]):
            if side is not None:
                assert set(side) >= {"compared", "effect", "effect_rest", "energy_effect", "rel_mse", "energy", "flip"}
        assert re.search(rf"^{term['name']}\s+[*-] +[+-]\d", said.out, re.M), term["name"]
    page = Page(Path("budget/index.html").read_text(encoding="utf-8"))
    assert {term.name for term in TERMS} <= page.ids
    assert all(link.startswith("#") and link[1:] in page.ids for link in page.links), "nothing else is needed"
    assert "http" not in Path("budget/index.html").read_text().replace("http-equiv", "")
    sides = sum((t["on_alone"] is not None) + (t["off_alone"] is not None) for t in record["terms"])
    assert len(page.images) == 4 + sides + 2 * len(PRESETS)
    assert all(decoded(uri).shape == (14, 24, 3) for uri in page.images)
    for term in record["terms"]:
        assert term["on_alone"]["compared"] in page.text
        assert term["what"] in page.text


def test_another_preset(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["attribute", str(quads), "-o", "b", *SMALL, "--preset", "demo", "--seed", "5"]) == 0
    record = json.loads(Path("b/attribution.json").read_text())
    assert record["preset"] == "demo" and record["params"]["shadow_estimator"] == "ratio_rgb"
    active = {t["name"] for t in record["terms"] if t["active"]}
    assert {"ratio_rgb", "levels", "centre", "gathering", "falloff"} <= active and "average" not in active
    assert "preset demo" in Path("b/index.html").read_text()
    demo = next(p for p in record["presets"] if p["name"] == "demo")
    for name in ("rel_mse", "energy", "flip"):
        assert demo[name] == record["frame"][name]
    capsys.readouterr()


def test_its_usual_names_and_quiet(quads: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["attribute", str(quads), *SMALL, "--quiet", "--no-cache"]) == 0
    assert files() == ["out/quads-attribution/attribution.json", "out/quads-attribution/index.html"]
    said = capsys.readouterr()
    assert not said.out and not said.err


def test_references_are_used_again(quads: Path, cache_folder: Path) -> None:
    for _ in range(2):
        assert main(["attribute", str(quads), "-o", "b", *SMALL, "--quiet"]) == 0
    assert len(files(cache_folder)) == 2


BAD_FLAGS = {
    "setting": (["--set", "alhpa=1"], "alpha"),
    "preset": (["--preset", "papier"], "'paper'"),
    "size": (["--size", "0x1"], "--size"),
    "folder": (["-o", ""], "-o"),
    "folder that is a file": (["-o", "taken"], "taken"),
    "camera": (["--camera", "frnt"], "front"),
    "engine": (["--engine", "gpu"], "cpu"),
}


@pytest.mark.parametrize("name", BAD_FLAGS)
def test_bad_flags_are_refused(quads: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("taken").write_text("a file")
    flags, hint = BAD_FLAGS[name]
    assert hint in refused(["attribute", str(quads), *flags], capsys)


def test_no_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert "lab attribute scenes" in refused(["attribute"], capsys)


def test_ctrl_c_leaves_nothing_half_written(
    quads: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("lab.attribute.bench.Bench.shadows", stopped)
    assert main(["attribute", str(quads), "-o", "b", *SMALL]) == 130
    assert capsys.readouterr().err == "lab: interrupted\n"
    assert files() == []


# --- pictures --------------------------------------------------------------------------------------------------------


def test_signed_pictures() -> None:
    error = np.zeros((10, 20))
    error[:, :5], error[:, 15:] = -0.4, 0.4
    found = pictures.signed(error)
    assert found.scale == 0.5 and (found.width, found.height) == (20, 10)
    pixels = decoded(found.uri)
    for x, value in ((0, -0.8), (19, 0.8)):
        near = SIGNED[round((1 + value) / 2 * 255) + np.arange(-3, 4)].astype(int)
        assert (near.min(axis=0) <= pixels[0, x]).all() and (pixels[0, x] <= near.max(axis=0)).all()
    assert pixels[0, 0, 2] > pixels[0, 0, 0] and pixels[0, 19, 0] > pixels[0, 19, 2], "blue is darker, red brighter"
    assert pixels[0, 10].min() > 230, "white is right"
    assert decoded(pictures.signed(np.full((4, 4), np.nan)).uri).min() > 230


def test_wide_pictures_shrink_by_means() -> None:
    error = np.zeros((700, 1290))
    error[::3] = 0.3
    found = pictures.signed(error)
    assert (found.width, found.height) == (430, 233) and found.scale == 0.1
    photograph = pictures.photograph(np.full((360, 641, 3), 0.2), 1.0)
    assert (photograph.width, photograph.height, photograph.scale) == (320, 180, 0)
    assert pictures.photograph(np.full((1, 2000, 3), 0.2), 1.0).height == 1
