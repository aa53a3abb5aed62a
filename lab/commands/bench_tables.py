"""A benchmark for people, on stdout: stages and limits, rates, ratios, and what changed since another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from lab.bench.compare import FASTER, SAME, SLOWER, Comparison
from lab.bench.definitions import LIMITS, RATIOS
from lab.bench.spread import Spread

Record = dict[str, Any]

_WIDTH = 120
_STYLE = {FASTER: "green", SLOWER: "red", SAME: "dim"}


def _console() -> Console:
    console = Console(highlight=False, soft_wrap=True)
    console.width = max(console.width, _WIDTH)  # a pipe has 80 columns, in which numbers would be cut
    return console


def _table(*columns: str, text: int = 1) -> Table:
    """A table whose first `text` columns hold words, the others numbers."""
    table = Table(box=None, pad_edge=False)
    for i, name in enumerate(columns):
        table.add_column(name, justify="left" if i < text else "right")
    return table


def print_benchmark(record: Record) -> None:
    """All that was measured of one scene."""
    console = _console()
    scene, machine, frame = record["scene"], record["machine"], record["frame_ms"]
    width, height = scene["size"]
    threads = machine["threads"]
    console.print(
        f"[bold]{escape(scene['name'])}[/] {width}x{height}, {scene['triangles']:,} triangles, "
        f"{record['counts']['lights']:,} lights, preset {record['preset']}: [bold]{frame['median']:,.1f} ms[/] a frame "
        f"({frame['q1']:,.1f} to {frame['q3']:,.1f}), {record['frames']} frames, "
        f"{threads} thread{'' if threads == 1 else 's'}, {machine['simd']}"
    )
    _print_stages(console, record["stages_ms"], frame, record["limits"]["stages_ms"])
    fast = record["fast_frame"]
    console.print(
        "\n"
        + " ".join(f"{name}={value}" for name, value in fast["settings"].items())
        + f": [bold]{fast['frame_ms']['median']:,.1f} ms[/] a frame"
    )
    _print_stages(console, fast["stages_ms"], fast["frame_ms"], fast["limits_ms"])
    console.print()
    _print_rates(console, record)
    console.print()
    _print_ratios(console, record["ratios"])
    for name, found in record["sweeps"].items():
        console.print()
        _print_sweep(console, name, found)
    for note in record["notes"]:
        console.print(f"note: {escape(note)}")
    console.print()


def _print_stages(console: Console, stages: Record, frame: Spread, limits: Record) -> None:
    table = _table("stage", "ms", "q1", "q3", "share", "limit", "reached")
    table.add_column("  by")
    rest = max(frame["median"], 1e-9)
    for stage, ms in stages.items():
        limit = limits[stage]["median"]
        table.add_row(
            stage,
            *_times(ms),
            f"{ms['median'] / rest:.0%}",
            f"{limit:,.2f}",
            f"{limit / ms['median']:.0%}" if ms["median"] > 0 else "",
            f"  [dim]{LIMITS[stage].by}[/]",
        )
    total = sum(limit["median"] for limit in limits.values())
    table.add_row("frame", *_times(frame), "", f"{total:,.2f}", f"{total / rest:.0%}", "  [dim]their sum[/]")
    console.print(table)


def _times(ms: Spread) -> list[str]:
    return [f"{ms[name]:,.2f}" for name in ("median", "q1", "q3")]


def _print_rates(console: Console, record: Record) -> None:
    table = _table("millions a second", "stage", "limit of this machine")
    for name, rate in record["rates"].items():
        limit = record["limits"][name] if name != "lights_built_per_s" else None
        table.add_row(name.removesuffix("_per_s").replace("_", " "), _millions(rate), _millions(limit))
    stream = record["limits"]["stream_bytes_per_s"]["median"]
    table.add_row("bytes streamed", "", _millions(stream))
    console.print(table)


def _millions(value: float | None) -> str:
    return "" if value is None else f"{value / 1e6:,.2f}"


def _print_ratios(console: Console, ratios: Record) -> None:
    table = _table("ratio", "value")
    table.add_column("  aim")
    table.add_column("is", overflow="fold")
    for name, definition in RATIOS.items():
        value = ratios[name]
        shown = "-" if value is None else f"{value:.3g}"
        table.add_row(name, f"[bold]{shown}[/]", f"  {escape(definition.aim)}", f"[dim]{escape(definition.formula)}[/]")
    console.print(table)


def _print_sweep(console: Console, name: str, found: Record) -> None:
    stages = list(found["stages_ms"][0])
    table = _table(name, "frame ms", *stages)
    for value, frame, ms in zip(found["values"], found["frame_ms"], found["stages_ms"], strict=True):
        row = [f"{frame['median']:,.1f}", *(f"{ms[stage]['median']:,.1f}" for stage in stages)]
        table.add_row(f"{value:,}", *row)
    console.print(table)


def print_comparison(comparison: Comparison, path: str) -> None:
    """Every time that was measured then and now; those beyond noise stand out."""
    console = _console()
    console.print(f"[bold]since {escape(path)}[/]")
    for warning in comparison.warnings:
        console.print(f"[yellow]warning:[/] {escape(warning)}")
    table = _table("time", "before ms", "now ms", "now / before")
    table.add_column("  verdict")
    for change in comparison.changes:
        style = _STYLE[change.verdict]
        table.add_row(
            escape(change.name),
            f"{change.before['median']:,.2f}",
            f"{change.now['median']:,.2f}",
            f"{change.factor:.3f}",
            f"  [{style}]{change.verdict}[/]",
        )
    console.print(table)
    ratios = _table("ratio", "before", "now")
    for name, (before, now) in comparison.ratios.items():
        ratios.add_row(name, f"{before:.3g}", f"{now:.3g}")
    console.print()
    console.print(ratios)
    console.print()


def print_end(paths: Sequence[Path], seconds: float) -> None:
    """What was written, and how long it all took."""
    _console().print(f"wrote {', '.join(escape(str(path)) for path in paths)} after {seconds:,.0f} s")
