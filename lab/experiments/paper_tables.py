"""The paper's Tables 1, 2 and 3 and its Figure 1, measured: ours beside theirs.

Run it: ``python -m lab.experiments.paper_tables sponza.glb --engine vulkan``.

Times are medians by the engine's clock (a device's own), measured in turns. `render` is everything but VPLs and
construction. Theirs are of an RTX 2080 and of their pictures of their scenes, so a ratio speaks of this machine with
this program, not of the method alone; Sponza is nearest. ``build`` is of the levels alone, as theirs; the lists that
our shadow rays draw from are in another row. The parts of a construction are timed on Vulkan only.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from lab import __version__
from lab.bench.measure import View
from lab.bench.spread import Spread
from lab.bench.turns import Turn, take_turns
from lab.engine.engine import ENGINES, STAGES
from lab.errors import LabError
from lab.experiments import paper_numbers as paper
from lab.outputs import check_writable, write_all
from lab.params import PRESETS, Params, preset
from lab.renderer import Renderer
from lab.report import core, machine, to_json
from lab.scene.load import load_scene
from lab.scene.scene import Scene

Record = dict[str, Any]
Times = dict[str, dict[str, Spread]]

RENDERING = STAGES[2:]
CARD_RUNS, RUNS, QUICK_RUNS = 64, 8, 2


@dataclass(frozen=True)
class Row:
    """One number of the paper and ours."""

    table: str
    name: str
    ours: Spread
    paper: float

    @property
    def factor(self) -> float:
        """How many times as fast ours is."""
        return self.paper / max(float(self.ours["median"]), 1e-9)


@dataclass(frozen=True)
class Sizes:
    """How many VPLs stand for the paper's."""

    growth: tuple[int, ...] = paper.VPLS

    @property
    def tables(self) -> int:
        """Of Tables 1 and 3: its third number."""
        return self.growth[2]

    @property
    def most(self) -> int:
        """Of Figure 1: the last."""
        return self.growth[3]


def paper_rows(view: View, sizes: Sizes, runs: int) -> Iterator[Row]:
    """Measures everything, and yields the rows of Tables 1, 2, 3 and of Figure 1."""
    found = take_turns(_turns(view, sizes), runs, lambda share, key: None)
    for construction, parts in paper.CONSTRUCTION.items():
        for part, theirs in parts.items():
            if part in found[construction]:
                yield Row("1", f"{construction}, {part}", found[construction][part], theirs)
    for column, vpls in enumerate(sizes.growth):
        plain, least, whole = (found[_name(vpls=vpls, shadow_samples=k)] for k in (0, 1, 4))
        ours = [whole["trace_vpls"], plain["build_hierarchy"], *(times["render"] for times in (plain, least, whole))]
        for (name, numbers), mine in zip(paper.GROWTH.items(), ours, strict=True):
            yield Row("2", f"{vpls:,} VPLs: {name}", mine, numbers[column])
        name = "build, with lists for shadow rays"
        yield Row("2", f"{vpls:,} VPLs: {name}", whole["build_hierarchy"], paper.GROWTH["build"][column])
    for column, n in enumerate(paper.INTERLEAVES):
        times = found[_name(vpls=sizes.tables, shadow_samples=4, interleave=n)]
        for stage, of_paper in paper.INTERLEAVED.items():
            mine = times["render" if stage == "total" else stage]
            yield Row("3", f"interleave={n}: {stage}", mine, of_paper[column])
    times = found[_name(vpls=sizes.most, shadow_samples=4, interleave=4, alpha=2)]
    name = f"{sizes.most:,} VPLs, alpha=2, interleave=4, shadow_samples=4: render"
    yield Row("Figure 1", name, times["render"], paper.FIGURE_1)
    for n in (1, 4):
        times = found[_name(vpls=sizes.most, shadow_samples=1, interleave=n)]
        name = f"{sizes.most:,} VPLs, interleave={n}, shadow_samples=1: all, with VPLs and build"
        yield Row("2, sum", name, times["frame"], paper.REGENERATED)


def _turns(view: View, sizes: Sizes) -> dict[str, Turn]:
    turns = {name: Turn(partial(_construction, view, sizes.tables, name)) for name in paper.CONSTRUCTION}
    settings: list[dict[str, float]] = [
        {"vpls": vpls, "shadow_samples": k, "interleave": 1, "alpha": 1} for vpls in sizes.growth for k in (0, 1, 4)
    ]
    settings += [{"vpls": sizes.tables, "shadow_samples": 4, "interleave": n, "alpha": 1} for n in paper.INTERLEAVES]
    settings += [
        {"vpls": sizes.most, "shadow_samples": 1, "interleave": 4, "alpha": 1},
        {"vpls": sizes.most, "shadow_samples": 4, "interleave": 4, "alpha": 2},
    ]
    return turns | {_name(**changes): Turn(partial(_frame, view, changes)) for changes in settings}


def _name(*, vpls: float, shadow_samples: float, interleave: float = 1, alpha: float = 1) -> str:
    return f"vpls={vpls} shadow_samples={shadow_samples} interleave={interleave} alpha={alpha}"


def _frame(view: View, changes: dict[str, float]) -> dict[str, float]:
    times = view.time_frame(**changes)
    return times | {"render": sum(times[stage] for stage in RENDERING)}


def _construction(view: View, vpls: int, construction: str) -> dict[str, float]:
    """Of levels without member lists, part by part where the engine can tell."""
    params = view.params.replace(vpls=vpls, construction=construction, shadow_samples=0)
    lights = view.engine.trace_vpls(params)
    if view.machine.device() is None:
        return {"total": view.clock(lambda: view.engine.build_hierarchy(lights, params))[1]}
    from lab.engine.vulkan.build_hierarchy import construction_ms
    from lab.engine.vulkan.engine import VulkanEngine

    assert isinstance(view.engine, VulkanEngine)
    return construction_ms(view.engine.gpu, lights, params)


def measure(
    scene: Scene,
    params: Params,
    size: tuple[int, int],
    *,
    engine: str = "cpu",
    device: str = "",
    runs: int | None = None,
    sizes: Sizes | None = None,
) -> Record:
    """All rows, with what they were measured on. `runs`: of each; 64 on a card, 8 elsewhere."""
    if scene.light_list is not None:
        raise LabError(f"{scene.name}: is lit by a list of lights; the paper's tables are over the number of VPLs")
    sizes = sizes or Sizes()
    with Renderer(scene, engine=engine, device=device) as renderer:
        view = View(renderer, scene.camera(), size, params)
        card = view.machine.device()
        if runs is None:
            runs = CARD_RUNS if card is not None and card["kind"] != "software" else RUNS
        rows = list(paper_rows(view, sizes, runs))
        frame = view.frame(vpls=sizes.tables, shadow_samples=4)
        rays = view.machine.limits(frame).work.rays["trace_shadow_rays"]
    ours = next(row.ours for row in rows if row.name == "interleave=1: trace_shadow_rays")
    return {
        "experiment": "paper_tables",
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "engine": engine,
        "device": card,
        "machine": machine() | core(),
        "version": __version__,
        "scene": {"name": scene.name, "triangles": scene.triangles, "size": list(size)},
        "params": params.to_dict(),
        "runs": runs,
        "rows": [
            {"table": row.table, "name": row.name, "ms": row.ours, "paper_ms": row.paper, "factor": row.factor}
            for row in rows
        ],
        "notes": _notes(sizes, card),
        "shadow_rays": {"count": rays, "per_s": 1e3 * rays / max(ours["median"], 1e-9)},
    }


def _notes(sizes: Sizes, card: Record | None) -> list[str]:
    """Why a ratio tells less than it seems to."""
    notes = []
    if sizes.growth != paper.VPLS:
        notes.append("other numbers of VPLs than the paper's: to see that it runs, not to compare")
    if card is not None and card["kind"] == "software":
        notes.append(f"{card['name']} is no card: its driver computes on the processor")
    return notes


def print_rows(record: Record) -> None:
    """Ours beside theirs."""
    device, (width, height) = record["device"], record["scene"]["size"]
    where = record["machine"]["cpu"] if device is None else f"{device['name']}, {device['driver']}"
    out = sys.stdout
    out.write(f"{record['scene']['name']} {width}x{height}, {record['runs']} runs, {where}, {record['date']}\n")
    wide = max(len(row["name"]) for row in record["rows"])
    out.write(f"{'table':<9} {'row':<{wide}} {'ms':>10} {'q1':>10} {'q3':>10} {'paper ms':>9} {'times as fast':>14}\n")
    for row in record["rows"]:
        ms = [f"{row['ms'][name]:>10.4g}" for name in ("median", "q1", "q3")]
        numbers = f"{' '.join(ms)} {row['paper_ms']:>9g} {row['factor']:>14.3g}"
        out.write(f"{row['table']:<9} {row['name']:<{wide}} {numbers}\n")
    for note in record["notes"]:
        out.write(f"note: {note}\n")
    rays = record["shadow_rays"]
    out.write(f"shadow rays: {rays['count']:,} a frame, {rays['per_s'] / 1e6:,.4g} million a second\n")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def main(argv: list[str] | None = None) -> int:
    """Prints the tables, and writes them as JSON."""
    parser = argparse.ArgumentParser(description="The paper's Tables 1, 2, 3 and Figure 1 on this machine")
    parser.add_argument("scene")
    parser.add_argument("--engine", choices=ENGINES, default="cpu")
    parser.add_argument("--device", default="", help="with --engine vulkan: a device's name or number")
    parser.add_argument("--preset", choices=list(PRESETS), default="ours")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--runs", type=int, help=f"of each row; default {CARD_RUNS} on a card, else {RUNS}")
    parser.add_argument("--quick", action="store_true", help="a hundredth of the VPLs, and 2 runs: only to try it out")
    parser.add_argument("--json", type=Path, help="default: out/paper_tables-ENGINE.json")
    args = parser.parse_args(argv)
    path = args.json or Path("out") / f"paper_tables-{args.engine}.json"
    try:
        check_writable(path)
        width, height = (int(side) for side in args.size.split("x"))
        record = measure(
            load_scene(args.scene),
            preset(args.preset),
            (width, height),
            engine=args.engine,
            device=args.device,
            runs=QUICK_RUNS if args.quick and args.runs is None else args.runs,
            sizes=Sizes(tuple(vpls // 100 for vpls in paper.VPLS)) if args.quick else None,
        )
        write_all({path: partial(_write, text=to_json(record))})
    except LabError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    print_rows(record)
    sys.stdout.write(f"wrote {path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
