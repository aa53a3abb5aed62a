"""A pixel clicked: its table, its samples, who answers for it. Every number is the library's."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest

from lab.colour import luminance
from lab.engine.cpu import CpuEngine
from lab.pixel import account, exact_shadow, sample_pixel

from .browser import Tab, frame, probed, renderer

PIXEL = (70, 60)


def number(cell: str) -> float:
    """What a cell says, a percentage as a share."""
    return float(cell.removesuffix(" %").replace(",", "")) / (100 if cell.endswith("%") else 1)


def core() -> CpuEngine:
    engine = renderer().engine
    assert isinstance(engine, CpuEngine)
    return engine


def vector(values: Any) -> list[float]:
    return [float(value) for value in values]


def test_the_table_is_the_probe_s(tab: Tab) -> None:
    tab.click_pixel(*PIXEL)
    probe = probed(*PIXEL)
    lights = probe.lights.sorted()
    rows = tab.until(lambda: tab.table("#pixel-lights"), lambda rows: len(rows) == min(150, len(lights)))
    assert len(rows) > 20
    lightness, total = luminance(lights.contribution), lights.cumulative_share
    heads = tab.find("#pixel-lights th").all_inner_texts()
    for i, row in enumerate(rows):
        cells = dict(zip(heads, row, strict=True))
        exact = {"light": f"{lights.index[i]}", "level": f"{lights.level[i]}", "B": f"{lights.blend_weight[i]:.3f}"}
        exact |= {"cos": f"{lights.receiver_cosine[i]:.3f}", "lobe": f"{lights.emission[i]:.3f}"}
        assert {name: cells.pop(name) for name in exact} == exact
        shares = {"share": lights.share[i], "sum": total[i], "p": lights.probability[i]}
        assert {name: number(cells.pop(name)) for name in shares} == pytest.approx(shares, rel=1e-3, abs=6e-5)
        rest = {"distance": lights.distance[i], "E": lightness[i], "f": lights.target_weight[i]}
        assert {name: number(cell) for name, cell in cells.items()} == pytest.approx(rest, rel=1e-3)
    said = tab.pairs("#pixel-summary")
    assert [number(cell) for cell in said["colour"].split()] == pytest.approx(vector(probe.image.colour), rel=1e-3)
    assert said["overdraw"] == f"{probe.overdraw.sum()}: " + " ".join(map(str, probe.overdraw))
    assert f"{len(lights):,} lights" in tab.text("#panel-pixel")
    pick = probe.picks.light[0]
    assert f"1: light {pick} (level {probe.picks.level[0]})" in tab.text(".lab-pixel-left")
    tab.until(lambda: tab.source("#pixel-plot")[:14], lambda start: start == "data:image/png", "the plot")

    # By level; a row selects its light, which the scene takes apart.
    tab.click("#order-level")
    tab.until(lambda: [row[1] for row in tab.table("#pixel-lights")], lambda levels: levels == sorted(levels))
    scene = tab.look("#scene img")
    row = tab.find("#pixel-lights tbody tr").nth(3)
    chosen = row.locator("td").first.inner_text()
    row.click()
    tab.until(lambda: tab.text("#pixel-lights .lab-chosen td"), lambda light: light == chosen)
    tab.until(lambda: tab.look("#scene img"), lambda now: now != scene, "the selected light in the scene")
    assert tab.saved()["light"] == int(chosen)

    # The same as files.
    name, content = tab.download("#probe-json")
    assert (name, json.loads(content)) == (f"pixel-{PIXEL[0]}-{PIXEL[1]}.json", json.loads(probe.to_json()))
    name, content = tab.download("#probe-csv")
    assert name.endswith(".csv") and content.decode() == probe.to_csv()
    assert len(list(csv.reader(io.StringIO(content.decode())))) > 20


def test_samples_and_account_are_the_library_s(tab: Tab) -> None:
    tab.click_pixel(*PIXEL)
    tab.click("#pixel-tab-samples")
    tab.find("#pixel-draws").fill("1000")
    tab.click("#pixel-sample")
    rows = tab.until(lambda: tab.table("#pixel-results"), bool, "the picks")
    made = frame()
    trials, exact = sample_pixel(core(), made, *PIXEL, 1000, seed=made.params.seed), exact_shadow(core(), made, *PIXEL)
    said = tab.pairs("#pixel-summary")
    assert said["chi-square p"] == f"{trials.p_value:.3g} ({trials.freedom + 1} bins)"
    assert said["visible, sampled"].startswith(f"{trials.mean_visibility:.4f} ±")
    assert said["visible, every ray"] == f"{exact.mean_visibility:.4f}"
    most = int(trials.probability.argmax())
    first = [f"{trials.index[most]}", f"{trials.level[most]}", f"{trials.count[most]}"]
    assert rows[0][:4] == [*first, f"{trials.draws * trials.probability[most]:.1f}"]
    tab.until(lambda: tab.source("#pixel-plot")[:14], lambda start: start == "data:image/png", "the plot")

    tab.find("#pixel-draws").fill("many")
    tab.click("#pixel-sample")
    assert "expected a whole number" in tab.message()

    tab.click("#pixel-tab-account")
    tab.click("#pixel-account")
    rows = tab.until(lambda: tab.table("#pixel-results"), lambda rows: any("frame - truth" in row for row in rows))
    found = account(core(), made, *PIXEL)
    total = next(row for row in rows if row[0] == "frame - truth")
    parts = [found.frame, found.truth, found.frame - found.truth]
    assert [number(cell) for cell in total[4:]] == pytest.approx([float(luminance(rgb)) for rgb in parts], rel=1e-3)
    best = found.sorted()
    assert rows[4][0] == f"{best.index[0]}" and number(rows[4][6]) == pytest.approx(
        float(luminance(best.difference[0])), rel=1e-3
    )

    # Another pixel has none of it yet.
    tab.click_pixel(30, 45)
    tab.until(lambda: tab.pairs("#pixel-summary"), lambda said: "chi-square p" not in said)
    tab.until(lambda: tab.table("#pixel-results"), lambda rows: not rows)


def test_a_pixel_of_the_background_is_no_trouble(tab: Tab) -> None:
    tab.click_pixel(2, 45)
    assert tab.pairs("#pixel-summary")["overdraw"].startswith("0")
    tab.click("#pixel-tab-samples")
    tab.click("#pixel-sample")
    tab.until(lambda: tab.pairs("#pixel-summary"), lambda said: "visible, every ray" in said or "ratio, noisy" in said)
    tab.click("#pixel-tab-account")
    tab.click("#pixel-account")
    tab.idle()
    tab.click_pixel(*PIXEL)
    tab.until(lambda: len(tab.table("#pixel-lights")), lambda rows: rows > 20)
