"""``lab bench``: what its record holds, that its ratios are what they are said to be, and what it refuses."""

from __future__ import annotations

import dataclasses
import io
import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lab.bench import measure, others, sweep
from lab.bench.definitions import HELP, LIMITS, RATIOS, SWEEPS, ratios_of
from lab.bench.measure import Effort
from lab.bench.ratios import ratios
from lab.cli import main
from lab.engine import STAGES
from lab.params import Params
from lab.scene.scene import Camera

from ..conftest import write_quads
from ..oracle_geometry.scenes import occluded_room, wall_lights
from .command_line import files, refused

KERNELS = ("lighting_vs_kernel", "lighting_vs_own_kernel")
FEW, SOME, MANY = 60, 200, 500
FLAGS = ["--size", "32x18", "--set", "vpls=200", "direct_samples=1", "--frames", "2"]


@pytest.fixture(scope="module", autouse=True)
def little_work() -> Any:
    """The same measurements on less."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measure, "Effort", partial(Effort, few=FEW, many=MANY, scattered=SOME))
        patch.setattr("lab.bench.limits.STREAM_BYTES", 2**20)
        patch.setitem(sweep.VALUES, "vpls", (FEW, SOME))
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """One benchmark's files and its record."""
    folder = tmp_path_factory.mktemp("bench")
    scene = write_quads(folder / "quads")
    out = folder / "out" / "b"
    sweeps = [word for name in SWEEPS for word in ("--sweep", name)]
    assert main(["bench", str(scene), "-o", str(out), *FLAGS, *sweeps, "--quiet"]) == 0
    return folder, json.loads(out.with_suffix(".json").read_text(), parse_constant=pytest.fail)


def spreads(part: Any) -> list[dict[str, float]]:
    if not isinstance(part, dict):
        return []
    return [part] if "q1" in part else [found for value in part.values() for found in spreads(value)]


def test_the_record_is_whole(run: tuple[Path, dict[str, Any]]) -> None:
    folder, record = run
    assert files(folder / "out") == sorted(["b.json", "b.png", *(f"b-{name}.png" for name in SWEEPS)])
    assert list(record["stages_ms"]) == list(record["limits"]["stages_ms"]) == list(STAGES)
    assert set(record["ratios"]) == set(ratios_of("cpu"))
    # So few pixels may be no whole group for the light kernel.
    assert all(value > 0 for name, value in record["ratios"].items() if name not in KERNELS)
    assert record["scene"]["size"] == [32, 18] and record["params"]["vpls"] == record["counts"]["lights"] == 200
    assert record["machine"]["threads"] >= 1 and record["machine"]["simd"] and record["frames"] == 2
    assert record["fast_frame"]["settings"] == {"interleave": 4, "shadow_samples": 1}
    found = spreads(record)
    assert len(found) >= 50
    assert all(0 <= s["q1"] <= s["median"] <= s["q3"] and s["runs"] >= 1 for s in found)
    assert all(ms["runs"] == 2 for ms in record["stages_ms"].values())
    assert all(record["stages_ms"][stage]["median"] > 0 for stage in STAGES)
    assert 0 < record["counts"]["pairs_used"] <= record["counts"]["pairs_visited"]
    assert record["counts"]["rays"]["render_gbuffer"] == 32 * 18


def test_ratios_are_what_they_are_said_to_be(run: tuple[Path, dict[str, Any]]) -> None:
    """Recomputed from the parts by the words of ``lab bench --help``."""
    record = run[1]
    counts, limits, fast = record["counts"], record["limits"], record["fast_frame"]

    def ms(part: dict[str, Any], name: str) -> float:
        return float(part[name]["median"])

    lighting, construction, growth = record["lighting_ms"], record["construction_ms"], record["growth"]
    many = construction["many"]
    assert many["bytes"] == 36 * many["lights"] == 36 * MANY and construction["scattered"]["lights"] == SOME
    assert (growth["few"]["lights"], growth["many"]["lights"]) == (FEW, MANY)
    expected: dict[str, float | None] = {
        "lighting_vs_kernel": ms(limits["stages_ms"], "light") / ms(record["stages_ms"], "light"),
        "lighting_vs_own_kernel": ms(limits, "own_light_kernel_ms") / ms(record["stages_ms"], "light"),
        "gbuffer_vs_embree": ms(limits["stages_ms"], "render_gbuffer") / ms(record["stages_ms"], "render_gbuffer"),
        "shadow_rays_vs_embree": ms(limits["stages_ms"], "trace_shadow_rays")
        / ms(record["stages_ms"], "trace_shadow_rays"),
        "visited_per_used": counts["pairs_visited"] / counts["pairs_used"],
        "interleave4_speedup": ms(lighting, "interleave=1") / ms(lighting, "interleave=4"),
        "k1_overhead": ms(lighting, "shadow_samples=1") / ms(lighting, "shadow_samples=0"),
        "k4_overhead": ms(lighting, "shadow_samples=4") / ms(lighting, "shadow_samples=0"),
        "construction_vs_stream": ms(many, "gather") / ms(many, "stream"),
        "construction_with_members_vs_stream": ms(many, "gather_with_members") / ms(many, "stream"),
        "gather_vs_scatter": ms(construction["scattered"], "gather") / ms(construction["scattered"], "scatter"),
        "growth_1k_1m": ms(growth["many"], "sum_ms") / ms(growth["few"], "sum_ms"),
        "frame_vs_limits": fast["frame_ms"]["median"] / sum(ms(fast["limits_ms"], stage) for stage in STAGES),
    }
    for name in KERNELS:
        expected[name] = expected[name] or None
    assert record["ratios"] == {
        name: value if value is None else pytest.approx(value) for name, value in expected.items()
    }
    rates = record["rates"]
    assert rates["light_evaluations_per_s"] == pytest.approx(
        counts["pairs_used"] / ms(record["stages_ms"], "light") * 1e3
    )
    assert rates["lights_built_per_s"] == pytest.approx(200 / ms(record["stages_ms"], "build_hierarchy") * 1e3)
    assert limits["gbuffer_rays_per_s"] == pytest.approx(32 * 18 / ms(limits["stages_ms"], "render_gbuffer") * 1e3)


def test_everything_is_made_anew(run: tuple[Path, dict[str, Any]]) -> None:
    found = run[1]["regenerated"]
    assert found["vpls"] == MANY
    assert list(found["frames"]) == [f"interleave={n} shadow_samples={k}" for n in (1, 4) for k in (1, 4)]
    for frame in found["frames"].values():
        assert all(frame["stages_ms"][stage]["median"] > 0 for stage in STAGES)
        assert frame["frame_ms"]["runs"] == 2 and "host_ms" not in frame


def test_who_else_had_the_processor() -> None:
    cores = os.cpu_count() or 1
    start, end = others.Moment(10.0, 100.0, 5.0), others.Moment(12.0, 100.0 + 1.5 * cores, 5.0 + cores)
    assert others.share_of_others(start, end) == pytest.approx(0.25)
    assert others.share_of_others(start, others.Moment(12.0, 100.0, 6.0)) == 0
    assert others.share_of_others(start, start) is others.share_of_others(None, end) is None
    moment = others.now()
    assert moment is None or (moment.busy > 0 and moment.own > 0)


def test_a_busy_processor_is_told(quads: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from lab.bench.run import bench
    from lab.scene.load import load_scene

    monkeypatch.setattr(others, "share_of_others", lambda *_: 0.4)
    effort = Effort(frames=2, few=FEW, many=MANY, scattered=SOME)
    record = bench(load_scene(quads), Params(vpls=50), size=(8, 4), effort=effort)
    assert record["share_of_others"] == 0.4 and any("40%" in note for note in record["notes"])


def test_the_streamed_bytes(run: tuple[Path, dict[str, Any]]) -> None:
    counts, pixels = run[1]["counts"], 32 * 18
    # Position, normal and depth; shadowed and weight twice; five times.
    assert counts["bytes"]["filter_shadows"] == 5 * pixels * (28 + 2 * 8)
    # Albedo, emission, depth, irradiance, direct, area, shadowed and weight; four colours and the ratio.
    assert counts["bytes"]["composite"] == pixels * (28 + 36 + 8 + 52)
    # A grid light has 15 floats, 3 half-words and a byte; an input light is read, too, and has an index.
    lights = counts["lights"] + counts["grid_lights"]
    assert counts["bytes"]["build_hierarchy"] >= 36 * 200 + 4 * 200 + 73 * lights


def test_sweeps(run: tuple[Path, dict[str, Any]]) -> None:
    found = run[1]["sweeps"]
    assert list(found) == list(SWEEPS)
    assert found["vpls"]["values"] == [FEW, SOME] and found["interleave"]["values"] == [1, 2, 4, 8]
    assert found["shadow_samples"]["values"][0] == 0 and found["threads"]["values"][0] == 1
    for one in found.values():
        assert len(one["values"]) == len(one["stages_ms"]) == len(one["frame_ms"])
        assert all(list(ms) == list(STAGES) for ms in one["stages_ms"])


@pytest.mark.parametrize(("most", "counts"), [(1, (1,)), (2, (1, 2)), (6, (1, 2, 4, 6)), (16, (1, 2, 4, 8, 16))])
def test_threads_are_doubled(most: int, counts: tuple[int, ...]) -> None:
    assert sweep.thread_counts(most) == counts


def test_pictures(run: tuple[Path, dict[str, Any]]) -> None:
    for path in (run[0] / "out").glob("*.png"):
        pixels = np.asarray(Image.open(io.BytesIO(path.read_bytes())).convert("RGB"))
        assert pixels.shape[1] > 1000 and pixels.shape[0] > 200
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20


def test_tables(quads: Path, empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", str(quads), *FLAGS, "--json", "elsewhere/b.json", "--sweep", "interleave"]) == 0
    assert files() == ["elsewhere/b.json", "out/quads-bench-interleave.png", "out/quads-bench.png"]
    said = capsys.readouterr()
    assert not said.err and "wrote out/quads-bench.png, elsewhere/b.json" in said.out
    for word in (*STAGES, *ratios_of("cpu"), "frame", "quads", "32x18", "made anew"):
        assert word in said.out, word


def test_several_scenes(quads: Path, empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = write_quads(empty_folder / "other", head='name = "other"\nexposure = 1.0\ngeometry = ["quads.obj"]\n')
    assert main(["bench", *FLAGS[:-2], "--frames", "2", "-o", "b", "--set", "seed=1", str(quads), str(other)]) == 0
    records = json.loads(Path("b.json").read_text())["scenes"]
    assert [record["scene"]["name"] for record in records] == ["quads", "other"]
    assert all(set(record["ratios"]) == set(ratios_of("cpu")) for record in records)
    said = capsys.readouterr().out
    assert "quads 32x18" in said and "other 32x18" in said


def test_comparing(
    run: tuple[Path, dict[str, Any]], empty_folder: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, before = str(run[0] / "quads" / "scene.toml"), str(run[0] / "out" / "b.json")
    assert main(["bench", scene, *FLAGS, "-o", "b", "--compare", before]) == 0
    said = capsys.readouterr().out
    assert "now / before" in said and "within noise" in said
    written = json.loads(Path("b.json").read_text())["comparison"]
    assert written["with"] == before and set(STAGES) <= set(written["times"])
    assert "alpha" in refused(["bench", scene, *FLAGS, "--set", "alpha=2", "--compare", before], capsys)
    assert "not cornell" in refused(["bench", str(root / "scenes/cornell/scene.toml"), "--compare", before], capsys)
    assert "choose another name" in refused(["bench", scene, *FLAGS, "--json", before, "--compare", before], capsys)


def test_a_list_of_lights_has_no_number_of_vpls() -> None:
    from lab.bench.run import bench

    camera = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
    scene = dataclasses.replace(occluded_room(wall_lights(4, 30)), cameras=[camera])
    record = bench(scene, Params(), size=(16, 9), effort=Effort(frames=2))
    assert record["growth"] == {"few": None, "many": None} and record["construction_ms"]["many"] is None
    missing = {name for name, value in record["ratios"].items() if value is None}
    assert missing == {
        "construction_vs_stream", "construction_with_members_vs_stream", "gather_vs_scatter", "growth_1k_1m"
    }  # fmt: skip
    assert any("list of lights" in note for note in record["notes"])
    assert record["limits"]["stages_ms"]["trace_vpls"]["median"] == 0


def test_nothing_to_divide_by_is_no_ratio(run: tuple[Path, dict[str, Any]]) -> None:
    record = json.loads(json.dumps(run[1]))
    record["counts"]["pairs_used"] = 0
    record["limits"]["stages_ms"]["light"]["median"] = record["limits"]["own_light_kernel_ms"]["median"] = 0.0
    found = ratios(record)
    assert found["lighting_vs_own_kernel"] is None
    assert found["visited_per_used"] is None and found["lighting_vs_kernel"] is None
    assert found["k1_overhead"] == run[1]["ratios"]["k1_overhead"]


def test_help_says_how_everything_is_computed() -> None:
    for name, definition in RATIOS.items():
        assert name in HELP and definition.formula in HELP
    assert list(LIMITS) == list(STAGES)
    assert all(f"{limit.by} {limit.of}" in HELP for limit in LIMITS.values())
    assert all(len(line) <= 120 for line in HELP.splitlines())


# --- refusals --------------------------------------------------------------------------------------------------------

BAD_FLAGS: dict[str, tuple[list[str], str]] = {
    "frames": (["--frames", "1"], "--frames 1"),
    "frames in words": (["--frames", "many"], "--frames many"),
    "sweep": (["--sweep", "vpl"], "'vpls'"),
    "setting": (["--set", "alhpa=1"], "alpha"),
    "filter": (["--set", "filter_backend=kornia"], "fused"),
    "engine": (["--engine", "gpu"], "cpu"),
    "size": (["--size", "0x1"], "--size"),
    "json": (["--json", ""], "--json"),
    "json that is the picture": (["--json", "out/quads-bench.png"], "picture"),
    "json that is a folder": (["--json", "."], "folder"),
    "nothing to compare with": (["--compare", "missing.json"], "missing.json"),
    "camera": (["--camera", "frnt"], "front"),
}


@pytest.mark.parametrize("name", BAD_FLAGS)
def test_bad_flags_are_refused(quads: Path, empty_folder: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    flags, hint = BAD_FLAGS[name]
    assert hint in refused(["bench", str(quads), *flags], capsys)


def test_the_default_scene(empty_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "scenes/atrium/scene.toml" in refused(["bench"], capsys)


def test_ctrl_c_leaves_nothing(
    quads: Path, empty_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("lab.bench.measure.growth", stopped)
    assert main(["bench", str(quads), *FLAGS]) == 130
    assert capsys.readouterr().err == "lab: interrupted\n"
    assert files() == []


def test_turns_alternate() -> None:
    from lab.bench.turns import Turn, take_turns

    order: list[str] = []

    def take(name: str) -> Callable[[], dict[str, float]]:
        return lambda: order.append(name) or {"ms": float(len(order))}  # type: ignore[func-returns-value]

    told: list[tuple[float, str]] = []
    turns = {"a": Turn(take("a")), "b": Turn(take("b"), every=2), "c": Turn(take("c"), every=2)}
    found = take_turns(turns, 4, lambda share, name: told.append((share, name)))
    assert "".join(order) == "abc" + "abc" + "a" + "abc" + "a", "a warm-up, then turns"
    assert "".join(name for _, name in told) == "".join(order)
    assert {name: times["ms"]["runs"] for name, times in found.items()} == {"a": 4, "b": 2, "c": 2}
    assert found["b"]["ms"]["median"] == (5 + 9) / 2, "the warm-up does not count"
    shares = [share for share, _ in told]
    assert shares == sorted(shares) and shares[0] == 0 and shares[-1] < 1
