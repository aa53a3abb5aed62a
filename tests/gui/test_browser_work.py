"""Longer work in a browser: growth, importance, leaks, cancelling; and the files that are handed over."""

from __future__ import annotations

import io
import zipfile

import numpy as np
from PIL import Image

from .browser import SIZE, Tab, frame

TINY = (48, 27)


def png_size(content: bytes) -> tuple[int, int]:
    picture = Image.open(io.BytesIO(content))
    assert picture.format == "PNG" and np.asarray(picture.convert("L")).std() > 1, "a picture of something"
    return picture.size


def test_files_are_handed_over(tab: Tab) -> None:
    tab.begin(panel="overdraw")
    tab.until(lambda: tab.table("#overdraw-table"), bool)

    def download(item: str) -> tuple[str, bytes]:
        tab.click("#downloads")
        tab.find(item).wait_for()
        return tab.download(item)

    name, content = download("#export-npz")
    made = frame()
    with np.load(io.BytesIO(content)) as levels:
        assert name == "cornell.npz" and len(levels.files) > 3
        positions = [levels[key] for key in levels.files if "position" in key]
        assert sum(len(rows) for rows in positions) == len(made.hierarchy.position)
    name, content = download("#export-vtm")
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        assert name == "cornell.zip" and any(part.endswith(".vtm") for part in packed.namelist())
        assert packed.testzip() is None and len(packed.namelist()) > len(made.hierarchy.levels)
    name, content = download("#screenshot-picture")
    assert (name, png_size(content)) == ("cornell-picture.png", SIZE)
    name, content = download("#screenshot-scene")
    width, height = png_size(content)
    assert name == "cornell-scene.png" and width >= 300 and height >= 200
    name, content = download("#screenshot-panel")
    assert (name, png_size(content)[0]) == ("cornell-panel.png", 960)


def test_growth_and_importance(tab: Tab) -> None:
    tab.begin(params={"vpls": 300, "filter": "none"}, size=TINY, panel="overdraw")
    tab.click("#overdraw-grow")
    tab.until(lambda: tab.source("#growth-plot"), bool, "the growth of overdraw")
    tab.click("#tab-shadows")
    alone = tab.until(lambda: tab.table("#shadow-table"), bool)
    assert len(alone[0]) == 2
    tab.click("#compare-importance")
    both = tab.until(lambda: tab.table("#shadow-table"), lambda rows: len(rows[0]) == 3, "both ways of picking")
    assert [row[0] for row in both] == [row[0] for row in alone]
    effective = next(row for row in both if row[0] == "effective lights")
    assert float(effective[1]) < float(effective[2]), "picked evenly, more lights are picked"
    tab.until(lambda: tab.find("#shadow-pictures img").count(), lambda n: n == 4)
    tab.click("#shadow-map-entropy")
    tab.until(lambda: tab.find("#shadow-pictures img").count(), lambda n: n == 2)
    assert tab.source("#shadow-plot").startswith("data:image/png")


def test_leaks_against_every_light_and_who_answers(tab: Tab) -> None:
    tab.begin(params={"vpls": 300}, size=TINY, panel="leaks")
    tab.until(lambda: tab.text("#panel-leaks"), lambda said: "Choose a reference" in said)
    tab.click("#leaks-brute_force")
    tab.until(lambda: tab.source("#leak-map"), bool, "the leak map")
    said = tab.pairs("#leak-table")
    assert said["reference"] == "brute force: every light" and float(said["energy ratio"]) > 0.3
    tab.until(lambda: tab.find(".lab-mark-spot").count(), bool, "marks of the worst places")
    tab.find("#panel-leaks .lab-link").first.click()
    tab.until(lambda: tab.table("#pixel-results"), lambda rows: any("frame - truth" in row for row in rows))
    assert tab.find("#pixel-lights").is_visible()


def test_a_running_job_is_cancelled(tab: Tab) -> None:
    tab.begin(params={"vpls": 20_000}, size=(640, 360), panel="leaks")
    tab.click("#leaks-path_tracer")
    tab.until(lambda: tab.text("#busy"), lambda said: "path tracer" in said)
    tab.click("#cancel")
    tab.idle()
    assert tab.source("#leak-map") == "" and "Choose a reference" in tab.text("#panel-leaks")
    tab.write("#size", "x".join(map(str, TINY)))
    tab.until(lambda: tab.find(".lab-image-a").evaluate("e => e.naturalWidth"), lambda width: width == TINY[0])
