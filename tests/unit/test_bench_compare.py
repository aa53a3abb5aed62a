"""``lab bench --compare``: more than noise or not, and only of what is the same."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from lab.bench.compare import FASTER, SAME, SLOWER, Change, compare, counterpart, read_benchmark, to_record
from lab.bench.definitions import RATIOS
from lab.bench.spread import spread
from lab.engine import STAGES
from lab.errors import LabError
from lab.params import Params


def ms(*values: float) -> dict[str, float]:
    return spread(values)


def benchmark(**changes: Any) -> dict[str, Any]:
    stages = {stage: ms(9, 10, 11) for stage in STAGES}
    return {
        "scene": {"name": "room", "triangles": 4, "lights": {"suns": 1}, "camera": {"fov_y_deg": 40.0}, "size": [8, 4]},
        "engine": "cpu",
        "params": Params().to_dict(),
        "machine": {"cpu": "a", "cores": 2, "os": "b", "threads": 2, "simd": "c"},
        "stages_ms": stages,
        "frame_ms": ms(69, 70, 71),
        "limits": {"stages_ms": {stage: ms(1, 1, 1) for stage in STAGES}, "stream_bytes_per_s": ms(1, 2, 3)},
        "fast_frame": {"stages_ms": stages, "frame_ms": ms(1, 2, 3), "limits_ms": stages},
        "construction_ms": {"many": {"gather": ms(1, 2, 3), "stream": ms(1, 1, 1)}},
        "growth": None,
        "ratios": dict.fromkeys(RATIOS, 2.0) | {"growth_1k_1m": None},
    } | changes


def fresh() -> dict[str, Any]:
    """One that shares nothing with others."""
    return json.loads(json.dumps(benchmark()))


@pytest.mark.parametrize(
    ("before", "now", "verdict"),
    [
        ((10, 11, 12), (5, 6, 7), FASTER),
        ((5, 6, 7), (10, 11, 12), SLOWER),
        ((10, 11, 12), (10, 11, 12), SAME),
        ((5, 10, 30), (4, 8, 28), SAME),
        ((10, 10, 10), (10.1, 10.1, 10.1), SLOWER),
    ],
)
def test_quartiles_tell_noise_from_change(before: Any, now: Any, verdict: str) -> None:
    change = Change("light", ms(*before), ms(*now))
    assert change.verdict == verdict
    assert change.factor == pytest.approx(sorted(now)[1] / sorted(before)[1])


def test_what_changed() -> None:
    before, now = benchmark(), fresh()
    now["stages_ms"]["light"] = ms(4, 5, 6)
    now["fast_frame"]["stages_ms"]["light"] = ms(19, 20, 21)
    now["ratios"]["k1_overhead"] = 1.5
    found = compare(now, before)
    verdicts = {change.name: change.verdict for change in found.changes}
    assert verdicts["light"] == FASTER and verdicts["fast_frame light"] == SLOWER
    assert {name for name, verdict in verdicts.items() if verdict != SAME} == {"light", "fast_frame light"}
    assert {"frame", "construction many gather", *STAGES} <= set(verdicts)
    assert not any("limit" in name or "stream" in name for name in verdicts)
    assert found.ratios["k1_overhead"] == (2.0, 1.5) and "growth_1k_1m" not in found.ratios
    assert found.warnings == []
    written = json.loads(json.dumps(to_record(found, "x.json"), allow_nan=False))
    assert written["times"]["light"]["factor"] == 0.5 and written["times"]["light"]["verdict"] == FASTER


def test_another_machine_is_told() -> None:
    now = benchmark(machine={"cpu": "z", "cores": 2, "os": "b", "threads": 2, "simd": "c"})
    assert any("cpu was a, is z" in warning for warning in compare(now, benchmark()).warnings)


def test_a_shared_processor_is_told() -> None:
    found = compare(benchmark(share_of_others=0.01), benchmark(share_of_others=0.3))
    assert found.warnings == ["then, other programs had 30% of the processors"]
    assert compare(benchmark(share_of_others=None), benchmark()).warnings == []


def test_a_busier_machine_is_told() -> None:
    now = fresh()
    now["limits"]["stages_ms"]["render_gbuffer"] = ms(2, 2, 2)
    (warning,) = compare(now, benchmark()).warnings
    assert "limits" in warning and "render_gbuffer x 2.00" in warning


def test_the_same_scene_is_found() -> None:
    other = benchmark(scene={**benchmark()["scene"], "name": "hall"})
    assert counterpart(benchmark(), [other, benchmark()], "x.json")["scene"]["name"] == "room"
    twice = benchmark(scene={**benchmark()["scene"], "size": [16, 9]})
    assert counterpart(benchmark(), [twice, benchmark()], "x.json")["scene"]["size"] == [8, 4]
    with pytest.raises(LabError, match="measured hall, not room"):
        counterpart(benchmark(), [other], "x.json")


DIFFERENT: dict[str, tuple[dict[str, Any], str]] = {
    "size": ({"scene": {**benchmark()["scene"], "size": [16, 9]}}, "size"),
    "triangles": ({"scene": {**benchmark()["scene"], "triangles": 5}}, "triangles"),
    "camera": ({"scene": {**benchmark()["scene"], "camera": {}}}, "camera"),
    "setting": ({"params": Params(alpha=2).to_dict()}, "alpha=2.0 there, 1.0 here"),
    "threads": ({"machine": {**benchmark()["machine"], "threads": 1}}, "1 threads there, 2 here"),
    "engine": ({"engine": "vulkan"}, "vulkan"),
}


@pytest.mark.parametrize("name", DIFFERENT)
def test_other_work_is_not_compared(name: str) -> None:
    changes, hint = DIFFERENT[name]
    with pytest.raises(LabError, match=hint):
        counterpart(benchmark(), [benchmark(**changes)], "x.json")


def test_a_setting_that_is_new_had_no_other_value() -> None:
    old = Params().to_dict()
    del old["deal_all"]
    counterpart(benchmark(), [benchmark(params=old)], "x.json")


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", "3", '{"scenes": []}', '{"scenes": [{}]}', '{"scenes": 3}', "\udcff", '{"params": {}}']
)
def test_what_is_no_benchmark(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(LabError, match=r"--compare .*x\.json"):
        read_benchmark(path)
    with pytest.raises(LabError, match="missing"):
        read_benchmark(tmp_path / "missing.json")


def test_one_scene_or_several(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text(json.dumps(benchmark()))
    assert len(read_benchmark(path)) == 1
    path.write_text(json.dumps({"scenes": [benchmark(), benchmark()]}))
    assert len(read_benchmark(path)) == 2
