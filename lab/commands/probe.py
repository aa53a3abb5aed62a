"""``lab probe``: why a pixel looks as it does, as tables on stdout and as a file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from lab.commands.loading import load, progress
from lab.commands.request import Request, read_request, whole_number
from lab.errors import LabError
from lab.outputs import check_writable

MOST_ROWS = 10**6
ENDINGS = (".json", ".csv")


def run(args: argparse.Namespace) -> None:
    """Renders, probes, prints, and writes the file if one is wanted."""
    request = read_request(args)
    x, y = (_coordinate(name, text) for name, text in (("X", args.x), ("Y", args.y)))
    top = whole_number("--top", args.top, 1, MOST_ROWS)
    draws = None if args.sample is None else whole_number("--sample", args.sample, 1, 2**22)
    output = None if args.output is None else _output(args.output)
    _check(request, draws)

    import lab
    from lab.commands.probe_tables import print_probe
    from lab.engine.cpu import CpuEngine
    from lab.pixel import account, exact_shadow, probe_pixel, sample_pixel
    from lab.pixel.probing import pixel_of
    from lab.pixel.tables import plain, write_text
    from lab.report import to_json

    pixel_of(request.size, x, y)
    with progress(request.quiet) as tell:
        loaded = load(request, tell, [] if output is None else [output])
        engine = CpuEngine(loaded.scene)
        frame = lab.render(loaded.scene, request.params, size=request.size, engine=engine, progress=tell, counts=False)
        tell("probing")
        probe = probe_pixel(engine, frame, x, y)
        trials = None if draws is None else sample_pixel(engine, frame, x, y, draws)
        exact = exact_shadow(engine, frame, x, y) if args.exact else None
        accounted = account(engine, frame, x, y).sorted() if args.account else None
        if output is not None and output.suffix.lower() == ".csv":
            probe.write(output)
        elif output is not None:
            more = {"sample": trials, "exact": exact, "account": accounted}
            record = probe.to_record() | {name: plain(value) for name, value in more.items() if value is not None}
            write_text(output, to_json(record))
    if not request.quiet:
        print_probe(probe, loaded.scene.name, top=top, trials=trials, exact=exact, accounted=accounted)
        if output is not None:
            sys.stdout.write(f"wrote {output}\n")


def _coordinate(name: str, text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 9):
        raise LabError(f"{name} {text}: expected a pixel as whole numbers X Y, counted from the upper left")
    return int(text)


def _output(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in ENDINGS:
        raise LabError(f"-o {text}: expected a name that ends in .json (everything) or .csv (the table of lights)")
    check_writable(path)
    return path


def _check(request: Request, draws: int | None) -> None:
    if draws is not None and request.params.shadow_samples == 0:
        raise LabError("--sample: shadow_samples=0 picks no lights, there is nothing to draw again")
