"""``lab attribute``: where the error of a frame comes from, as a table, DIR/index.html and DIR/attribution.json."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from lab.commands.loading import load
from lab.commands.progress_bar import progress_bar
from lab.commands.render import scene_stem, write_text
from lab.commands.request import read_request
from lab.errors import LabError
from lab.outputs import check_writable, write_all
from lab.params import parse_assignments

if TYPE_CHECKING:
    from rich.console import Console

    from lab.attribute import ErrorBudget
    from lab.attribute.budget import Row, Side

PAGE, JSON = "index.html", "attribution.json"
SIZE = "640x360"
_TABLE_WIDTH = 110


def run(args: argparse.Namespace) -> None:
    """Measures every term, writes both files, and prints the table."""
    args.size = args.size or SIZE
    request = read_request(args)
    if args.output == "":
        raise LabError("-o: expected the name of a folder, for example -o out/sponza-attribution")
    folder = Path(args.output) if args.output else Path("out") / f"{scene_stem(request.scene)}-attribution"
    paths = [folder / PAGE, folder / JSON]
    for path in paths:
        check_writable(path)

    from lab.attribute import attribute
    from lab.attribute.page import draw_page
    from lab.attribute.record import to_record
    from lab.report import to_json

    changes: dict[str, object] = {**parse_assignments(args.assignments)}
    if args.seed is not None:
        changes["seed"] = args.seed
    with progress_bar(request.quiet) as tell:
        loaded = load(request, lambda stage: tell(0.0, stage), paths)
        budget = attribute(
            loaded.scene,
            request.params,
            size=request.size,
            changes=changes,
            cache=not args.no_cache,
            progress=tell,
        )
        tell(1.0, "writing")
        texts = draw_page(budget, request.preset), to_json(to_record(budget, request.preset, request.overrides))
        write_all({path: partial(write_text, text=text) for path, text in zip(paths, texts, strict=True)})
    if not request.quiet:
        _print(budget, paths)


def _print(budget: ErrorBudget, paths: list[Path]) -> None:
    from rich.console import Console
    from rich.markup import escape

    console = Console(highlight=False, soft_wrap=True)
    console.width = max(console.width, _TABLE_WIDTH)  # a pipe has 80 columns, in which numbers would be cut
    bench, score = budget.bench, budget.frame.score
    console.print(
        f"[bold]{escape(bench.scene.name)}[/] {bench.size[0]}x{bench.size[1]}: relMSE [bold]{score.rel_mse:.4g}[/] "
        f"(rest {score.rel_mse_rest:.4g}), energy {score.energy:.3f}, FLIP {_flip(score.flip)}, "
        f"{budget.frame.seconds:.2f} s, against {bench.truth.method} with {bench.truth.samples:,} samples"
    )
    _print_terms(console, budget)
    _print_presets(console, budget)
    for name, found in zip(("on alone", "off alone"), _largest(budget), strict=True):
        console.print(f"largest {name}: " + ", ".join(f"{row.term.name} {side.effect:+.3g}" for row, side in found))
    for note in (*bench.scene.notes, *budget.notes):
        console.print(f"note: {escape(note)}")
    console.print(f"wrote {', '.join(escape(str(path)) for path in paths)} after {budget.seconds:.0f} s")


def _print_terms(console: Console, budget: ErrorBudget) -> None:
    from rich.table import Table

    console.print(
        "effect: relMSE with the term less relMSE without it; rest: without the worst thousandth of the pixels.\n"
        "on: alone, all else exact; off: alone, from the frame (terms marked - are not in it, and are added)."
    )
    table = Table("term", "", box=None, pad_edge=False)
    for side in ("on", "off"):
        for name in ("effect", "rest", "energy", "FLIP"):
            table.add_column(f"{side}: {name}" if name == "effect" else name, justify="right")
    table.add_column("s", justify="right")
    for row in budget.rows:
        seconds = "" if row.off is None or row.off.seconds is None else f"{row.off.seconds:.2f}"
        table.add_row(row.term.name, "*" if row.active else "-", *_cells(row.on), *_cells(row.off), seconds)
    console.print(table)


def _cells(side: Side | None) -> list[str]:
    if side is None:
        return [""] * 4
    return [f"{side.effect:+.4f}", f"{side.effect_rest:+.4f}", f"{side.score.energy:.3f}", _flip(side.score.flip)]


def _flip(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _print_presets(console: Console, budget: ErrorBudget) -> None:
    from rich.table import Table

    table = Table("preset", box=None, pad_edge=False)
    for name in ("relMSE", "rest", "energy", "FLIP", "s"):
        table.add_column(name, justify="right")
    for found in budget.presets:
        score = found.score
        values = f"{score.rel_mse:.4f}", f"{score.rel_mse_rest:.4f}", f"{score.energy:.3f}", _flip(score.flip)
        table.add_row(found.name, *values, f"{found.seconds:.2f}")
    console.print(table)


def _largest(budget: ErrorBudget) -> tuple[list[tuple[Row, Side]], list[tuple[Row, Side]]]:
    """The three terms of the frame with the greatest effect, on alone and off alone."""
    active = [row for row in budget.rows if row.active]
    sides = [[(row, side) for row in active if (side := getattr(row, name)) is not None] for name in ("on", "off")]
    on, off = (sorted(found, key=lambda pair: -pair[1].effect)[:3] for found in sides)
    return on, off
