"""The whole benchmark of one scene, as one record."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from lab import __version__
from lab.bench import measure, others
from lab.bench.measure import FAST, Effort, Part, View
from lab.bench.ratios import ratios
from lab.bench.sweep import sweep
from lab.bench.turns import take_turns
from lab.engine.memory import check_memory
from lab.errors import LabError
from lab.params import Params
from lab.renderer import Renderer
from lab.report import camera_record, core, light_counts, machine
from lab.scene.scene import Scene

Record = dict[str, Any]
Progress = Callable[[float, str], None]

_PREPARING = 0.1

RATES = {
    "light_evaluations_per_s": "light",
    "vpl_rays_per_s": "trace_vpls",
    "gbuffer_rays_per_s": "render_gbuffer",
    "shadow_rays_per_s": "trace_shadow_rays",
    "lights_built_per_s": "build_hierarchy",
}
"""What is done a second, and the stage that does it."""


def header(
    scene: Scene,
    size: tuple[int, int],
    params: Params,
    *,
    preset: str = "ours",
    engine: str = "cpu",
    device: Record | None = None,
) -> Record:
    """What is measured and on what: known before anything is. `device`: the card of engine ``vulkan``."""
    return {
        "scene": {
            "path": str(Path(scene.path).resolve()) if scene.path else "",
            "name": scene.name,
            "triangles": scene.triangles,
            "lights": light_counts(scene),
            "camera": camera_record(scene.camera("")),
            "size": list(size),
        },
        "preset": preset,
        "engine": engine,
        "device": device,
        "params": params.to_dict(),
        "machine": machine() | core(),
        "version": __version__,
    }


def bench(
    scene: Scene,
    params: Params,
    *,
    size: tuple[int, int],
    preset: str = "ours",
    engine: str = "cpu",
    device: str = "",
    effort: Effort | None = None,
    sweeps: Sequence[str] = (),
    progress: Progress | None = None,
) -> Record:
    """Measures frames of the scene's first camera against the machine's limits; see :mod:`lab.bench.definitions`.

    `engine` and `device` as of :class:`lab.Renderer`; times are of the engine's clock.
    Returns a record of ``stages_ms``, ``rates``, ``limits``, ``ratios`` and all that these are computed from.
    """
    effort = effort or Effort()
    if params.filter_backend != "fused":
        raise LabError(f"filter_backend={params.filter_backend}: the benchmark measures the engine's own filter, fused")
    many = max([params.vpls, effort.many] if scene.light_list is None else [len(scene.light_list)])
    check_memory(2 * many, size, params)
    start, begin = time.perf_counter(), others.now()
    notes = list(scene.notes)
    tell = progress or (lambda share, line: None)
    with Renderer(scene, engine=engine, device=device) as renderer:
        view = View(renderer, scene.camera(""), size, params)
        record = header(scene, size, params, preset=preset, engine=engine, device=view.machine.device())
        found = _measure(view, effort, notes, tell, 1 / (1 + 0.5 * len(sweeps)))
        swept = _sweep(view, effort, sweeps, tell)
    if record["device"] and record["device"]["kind"] == "software":
        few = f"{effort.many:,} VPLs stand for 1M, {effort.scattered:,} for 100K"
        notes.append(
            f"{record['device']['name']} is no card: its driver computes on the processor. Its times tell nothing "
            f"about cards, which are given more frames; {few}"
        )
    frame = found["frame"]
    record["date"] = datetime.now(UTC).isoformat(timespec="seconds")
    record["frames"] = effort.frames
    record |= {name: frame[name] for name in ("stages_ms", "frame_ms", "host_ms", "wall_ms") if name in frame}
    record["counts"] = frame["counts"]
    record["rates"] = _rates(frame, frame["stages_ms"])
    record["limits"] = {
        "stream_bytes_per_s": frame["stream_bytes_per_s"],
        **_rates(frame, frame["limits_ms"]),
        "stages_ms": frame["limits_ms"],
        "own_light_kernel_ms": frame["own_kernel_ms"],
    }
    record |= {"fast_frame": found["fast_frame"], "lighting_ms": found["lighting"]}
    record["construction_ms"] = {name: found.get(name) for name in ("many", "scattered")}
    record["regenerated"] = found["regenerated"]
    record["growth"] = {name: found.get(f"growth {name}") for name in ("few", "many")}
    record["ratios"] = ratios(record)
    record["sweeps"] = swept
    record["seconds"] = round(time.perf_counter() - start, 3)
    share = others.share_of_others(begin, others.now())
    record["share_of_others"] = None if share is None else round(share, 4)
    if share is not None and share > others.QUIET:
        notes.append(
            f"other programs had {share:.0%} of the processors meanwhile: times are too long and ratios unsure; "
            "measure again while nothing else runs"
        )
    return record | {"notes": notes}


def _measure(view: View, effort: Effort, notes: list[str], tell: Progress, share: float) -> dict[str, Record]:
    """Everything but the sweeps, in turns: what one part finds is not of a quieter minute than what another does."""
    every, seldom = effort.every, effort.seldom
    makers: dict[str, Callable[[], Part]] = {
        "frame": lambda: measure.whole_frames(view, 1, every),
        "fast_frame": lambda: measure.whole_frames(view, every, every, **FAST),
        "lighting": lambda: measure.lighting(view, every),
        "regenerated": lambda: measure.regenerated(view, effort),
    }
    if view.light_list:
        notes.append("lit by a list of lights: construction and growth over the number of VPLs were not measured")
    else:
        makers |= {
            "many": lambda: measure.construction_of_many(view, effort),
            "scattered": lambda: measure.construction_by_scatter(view, effort),
            "growth few": lambda: measure.growth(view, effort.few, seldom),
            "growth many": lambda: measure.growth(view, effort.many, seldom),
        }
    parts: dict[str, Part] = {}
    for i, (name, make) in enumerate(makers.items()):
        tell(_PREPARING * share * i / len(makers), "preparing")
        parts[name] = make()
    turns = {(part, name): turn for part, made in parts.items() for name, turn in made.turns.items()}
    found = take_turns(
        turns,
        effort.frames,
        lambda done, key: tell(share * (_PREPARING + (1 - _PREPARING) * done), " ".join(dict.fromkeys(key))),
    )
    return {part: made.record({name: found[part, name] for name in made.turns}) for part, made in parts.items()}


def _sweep(view: View, effort: Effort, names: Sequence[str], tell: Progress) -> dict[str, Record]:
    rounds, first = effort.frames // effort.seldom, 1 / (1 + 0.5 * len(names))
    found = {}
    for i, name in enumerate(names):

        def told(done: float, key: str, i: int = i, name: str = name) -> None:
            tell(first + (1 - first) * (i + done) / len(names), f"{name}={key}")

        found[name] = sweep(view, name, rounds, told)
    return found


def _rates(frame: Record, ms: Record) -> dict[str, float | None]:
    counts = frame["counts"]
    work = {"light": counts["pairs_used"], "build_hierarchy": counts["lights"], **counts["rays"]}
    seconds = {stage: ms[stage]["median"] / 1e3 for stage in RATES.values()}
    return {
        name: work[stage] / seconds[stage] if work[stage] and seconds[stage] > 0 else None
        for name, stage in RATES.items()
    }
