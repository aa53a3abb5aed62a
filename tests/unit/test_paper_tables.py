"""The paper's tables, measured on next to nothing: every row is there, and says what it says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from lab.bench.spread import spread
from lab.engine import STAGES
from lab.errors import LabError
from lab.experiments import paper_numbers, paper_tables
from lab.experiments.paper_tables import Row, Sizes, measure
from lab.params import Params
from lab.scene.load import load_scene

from ..oracle_geometry.scenes import occluded_room, wall_lights

SIZES = Sizes((20, 40, 80, 160))


def measured(scene: Path, engine: str) -> dict[str, Any]:
    return measure(load_scene(scene), Params(direct_samples=1), (24, 16), engine=engine, runs=2, sizes=SIZES)


def check(record: dict[str, Any], parts: int) -> None:
    rows = record["rows"]
    named = {(row["table"], row["name"]): row for row in rows}
    assert len(named) == len(rows) == parts + 4 * 6 + 3 * 6 + 1 + 2
    for row in rows:
        assert 0 < row["ms"]["q1"] <= row["ms"]["q3"] and row["ms"]["runs"] == 2
        assert row["factor"] == pytest.approx(row["paper_ms"] / row["ms"]["median"])
    theirs = {key: row["paper_ms"] for key, row in named.items()}
    assert theirs["1", "gather, total"] == 12.1 and theirs["1", "scatter, total"] == 2110
    assert theirs["2", "80 VPLs: render, shadow_samples=4"] == 28.5 and theirs["2", "160 VPLs: build"] == 32
    assert theirs["3", "interleave=4: light"] == 3.8 and theirs["3", "interleave=2: total"] == 15.2
    ours = {key: row["ms"]["median"] for key, row in named.items()}
    # One frame has all of these, so the total is the sum of medians but for noise.
    stages = sum(ours["3", f"interleave=4: {stage}"] for stage in STAGES[2:])
    assert ours["3", "interleave=4: total"] == pytest.approx(stages, rel=0.6)
    assert record["shadow_rays"]["count"] > 24 * 16 / 2 and record["shadow_rays"]["per_s"] > 0
    assert json.loads(json.dumps(record, allow_nan=False)) == record


def test_all_rows_on_the_processor(quads: Path) -> None:
    record = measured(quads, "cpu")
    assert record["engine"] == "cpu" and record["device"] is None
    check(record, parts=2)


def test_all_rows_on_a_device(gpu: Any, quads: Path) -> None:
    record = measured(quads, "vulkan")
    assert record["device"]["driver"] and record["date"][:2] == "20"
    parts = {row["name"] for row in record["rows"] if row["table"] == "1"}
    for construction in ("gather", "scatter"):
        assert {f"{construction}, {part}" for part in ("bounds", "S1", "S2", "merge", "total")} <= parts
    check(record, len(parts))


def test_the_parts_of_a_construction_are_its_whole(gpu: Any) -> None:
    from lab.engine.vulkan.build_hierarchy import construction_ms

    lights = wall_lights(20, 600)
    for _ in range(2):  # drivers compile in the first
        ms = construction_ms(gpu, lights, Params(shadow_samples=0))
    total = ms.pop("total")
    assert list(ms)[:4] == ["bounds", "S1", "merge", "S2"] and all(part > 0 for part in ms.values())
    assert 0.5 * total < sum(ms.values()) <= total
    assert construction_ms(gpu, lights, Params())["members"] > 0


def test_a_factor_tells_how_many_times_as_fast() -> None:
    assert Row("1", "a", spread([2.0]), 10.0).factor == 5


def test_the_paper_s_sums() -> None:
    """The printed numbers agree with each other, as far as they are rounded."""
    gather = paper_numbers.CONSTRUCTION["gather"]
    assert sum(gather.values()) - gather["total"] == pytest.approx(gather["total"], abs=0.3)
    for n in range(3):
        column = {name: numbers[n] for name, numbers in paper_numbers.INTERLEAVED.items()}
        assert sum(column.values()) - column["total"] == pytest.approx(column["total"], abs=0.25)
    table = paper_numbers.GROWTH
    parts = (table[name][-1] for name in ("VPLs", "build", "render, shadow_samples=1"))
    assert sum(parts) == pytest.approx(paper_numbers.REGENERATED)


def test_the_program_writes_and_prints(
    quads: Path, empty_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(paper_tables, "RUNS", 2)
    assert paper_tables.main([str(quads), "--quick", "--size", "24x16", "--json", "t.json"]) == 0
    record = json.loads(Path("t.json").read_text())
    assert record["runs"] == 2 and "not to compare" in record["notes"][0]
    said = capsys.readouterr().out
    assert "times as fast" in said and "gather, total" in said and "wrote t.json" in said
    assert paper_tables.main([str(quads), "--json", "."]) == 2
    assert "error:" in capsys.readouterr().err


def test_a_list_of_lights_has_no_tables() -> None:
    with pytest.raises(LabError, match="number of VPLs"):
        measure(occluded_room(wall_lights(4, 30)), Params(), (8, 8))
