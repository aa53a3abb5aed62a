"""``lab bench``: the stages against the machine's limits, as tables, BASE.png and BASE.json."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.commands.loading import Loaded, load
from lab.commands.progress_bar import progress_bar
from lab.commands.render import scene_stem, write_text
from lab.commands.request import Request, read_request, whole_number
from lab.engine.engine import ENGINES
from lab.errors import LabError
from lab.outputs import base_path, beside, check_no_input, check_writable, write_all

if TYPE_CHECKING:
    from lab.bench.compare import Comparison
    from lab.bench.measure import Effort

Record = dict[str, Any]

DEFAULT_SCENE = "scenes/atrium/scene.toml"
FEWEST, MOST = 2, 10_000
CPU_FRAMES, CARD_FRAMES, SOFTWARE_FRAMES = 32, 256, 8
_QUICK = 4
_LOADING = 0.02


@dataclass(frozen=True)
class Files:
    """Where everything goes: the bars, the JSON, and a picture a sweep."""

    bars: Path
    json: Path
    sweeps: dict[str, Path]

    @property
    def all(self) -> list[Path]:
        """Each of them."""
        return [self.bars, self.json, *self.sweeps.values()]


def run(args: argparse.Namespace) -> None:
    """Measures every scene, writes the files, all or none, and prints the tables."""
    from lab.bench.sweep import check_sweeps

    requests = _requests(args)
    check_sweeps(args.sweep, requests[0].engine)
    effort = _effort(args, requests[0])

    from lab.bench.compare import read_benchmark
    from lab.commands.bench_tables import print_benchmark, print_comparison, print_end
    from lab.report import to_json

    before = read_benchmark(args.compare) if args.compare is not None else []
    files = _files(args, requests)
    if args.compare is not None:
        check_no_input(files.all, [Path(args.compare)], "what is compared with; choose another name with -o or --json")
    quiet = requests[0].quiet
    with progress_bar(quiet) as tell:
        scenes = [load(request, lambda stage: tell(0.0, stage), files.all) for request in requests]
        pairs = list(zip(scenes, requests, strict=True))
        # Asked now: after minutes of measuring it would be too late to learn that there is nothing to compare with.
        counterparts = [_counterpart(*pair, before, args.compare) for pair in pairs]
        records = []
        for i, pair in enumerate(pairs):

            def progress(share: float, line: str, i: int = i) -> None:
                tell(_LOADING + (1 - _LOADING) * (i + share) / len(scenes), f"{scenes[i].scene.name}: {line}")

            records.append(_bench(*pair, effort, list(files.sweeps), progress))
        comparisons = _compare(records, counterparts, args.compare)
        tell(1.0, "writing")
        text = to_json(records[0] if len(records) == 1 else {"scenes": records})
        write_all({files.json: partial(write_text, text=text)} | _pictures(records, files))
    if quiet:
        return
    for record, comparison in zip(records, comparisons, strict=True):
        print_benchmark(record)
        if comparison is not None:
            print_comparison(comparison, args.compare)
    print_end(files.all, sum(record["seconds"] for record in records))


def _requests(args: argparse.Namespace) -> list[Request]:
    given = vars(args)
    return [read_request(argparse.Namespace(**given, scene=scene), ENGINES) for scene in args.scenes or [DEFAULT_SCENE]]


def _effort(args: argparse.Namespace, request: Request) -> Effort:
    software = _is_software(request)
    usual = SOFTWARE_FRAMES if software else CPU_FRAMES if request.engine == "cpu" else CARD_FRAMES
    usual = max(FEWEST, usual // (_QUICK if args.quick else 1))
    frames = usual if args.frames is None else whole_number("--frames", args.frames, FEWEST, MOST)

    from lab.bench.measure import Effort

    return Effort.in_software(frames) if software else Effort(frames=frames)


def _is_software(request: Request) -> bool:
    """Whether the engine is one for cards, and the device none."""
    if request.engine == "cpu":
        return False
    from lab.engine.vulkan.device import open_gpu

    return open_gpu(request.device).software


def _files(args: argparse.Namespace, requests: list[Request]) -> Files:
    """Checked: each could be written, and no two are the same."""
    stem = scene_stem(requests[0].scene) + "-" if len(requests) == 1 else ""
    base = Path("out") / f"{stem}bench" if args.output is None else base_path(args.output)
    if args.json == "":
        raise LabError("--json: expected the name of a file, for example --json out/bench.json")
    files = Files(
        beside(base, ".png"),
        beside(base, ".json") if args.json is None else Path(args.json),
        {name: beside(base, f"-{name}.png") for name in args.sweep},
    )
    for path in files.all:
        check_writable(path)
    if len({path.resolve() for path in files.all}) < len(files.all):
        raise LabError(f"--json {files.json}: a picture has that name; choose another")
    return files


def _counterpart(loaded: Loaded, request: Request, before: list[Record], path: str | None) -> Record | None:
    from lab.bench.compare import counterpart
    from lab.bench.run import header

    if path is None:
        return None
    run = loaded.run
    now = header(loaded.scene, request.size, request.params, preset=run.preset, engine=run.engine, device=run.device)
    return counterpart(now, before, path)


def _bench(
    loaded: Loaded, request: Request, effort: Effort, sweeps: list[str], progress: Callable[[float, str], None]
) -> Record:
    from lab.bench.run import bench

    return bench(
        loaded.scene,
        request.params,
        size=request.size,
        preset=request.preset,
        engine=request.engine,
        device=request.device,
        effort=effort,
        sweeps=sweeps,
        progress=progress,
    )


def _compare(records: list[Record], counterparts: list[Record | None], path: str | None) -> list[Comparison | None]:
    """Of each scene; the records get theirs, too."""
    from lab.bench.compare import compare, to_record

    found: list[Comparison | None] = []
    for record, before in zip(records, counterparts, strict=True):
        found.append(None if before is None else compare(record, before))
        if found[-1] is not None and path is not None:
            record["comparison"] = to_record(found[-1], path)
    return found


def _pictures(records: list[Record], files: Files) -> dict[Path, Callable[[Path], None]]:
    from lab.bench.picture import draw_bars, machine_line, scene_groups, sweep_group
    from lab.image_io import write_png

    where = machine_line(records[0])
    metadata = {"machine": where, "lab_version": records[0]["version"]}
    groups = [group for record in records for group in scene_groups(record)]
    drawn = {files.bars: draw_bars(f"Median milliseconds of a frame: {where}", groups)}
    for name, path in files.sweeps.items():
        bars = [sweep_group(record, name) for record in records]
        drawn[path] = draw_bars(f"Median milliseconds of a frame over {name}: {where}", bars)
    return {path: partial(write_png, pixels=pixels, metadata=metadata) for path, pixels in drawn.items()}
