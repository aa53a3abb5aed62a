"""What was measured and is kept here says on what, by which driver, and when."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

import pytest

from .project import ROOT

MEASURED = sorted((ROOT / "lab" / "experiments" / "measured").glob("*.json"))


def test_there_is_something() -> None:
    assert {path.name for path in MEASURED} >= {"bench_llvmpipe.json", "paper_tables_llvmpipe.json"}


@pytest.mark.parametrize("path", MEASURED, ids=lambda path: path.name)
def test_a_record_says_where_it_is_from(path: Any) -> None:
    record = json.loads(path.read_text(encoding="utf-8"))
    device = record["device"]
    assert device["name"] and device["driver"] and device["slangpy"]
    assert record["machine"]["cpu"] and record["machine"]["os"] and record["version"]
    assert datetime.fromisoformat(record["date"]).year >= 2026
    assert path.stat().st_size < 2**18
