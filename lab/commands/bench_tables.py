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
from lab.bench.picture import machine_line, vpls_of
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
    scene, frame = record["scene"], record["frame_ms"]
    width, height = scene["size"]
    console.print(
        f"[bold]{escape(scene['name'])}[/] {width}x{height}, {scene['triangles']:,} triangles, "
        f"{record['counts']['lights']:,} lights, preset {record['preset']}: "
        f"[bold]{_number(frame['median'])} ms[/] a frame "
        f"({_number(frame['q1'])} to {_number(frame['q3'])}), {record['frames']} frames, {escape(machine_line(record))}"
    )
    _print_host(console, record)
    _print_stages(console, record["stages_ms"], frame, record["limits"]["stages_ms"])
    fast = record["fast_frame"]
    console.print(
        "\n"
        + " ".join(f"{name}={value}" for name, value in fast["settings"].items())
        + f": [bold]{_number(fast['frame_ms']['median'])} ms[/] a frame"
    )
    _print_host(console, fast)
    _print_stages(console, fast["stages_ms"], fast["frame_ms"], fast["limits_ms"])
    console.print()
    _print_rates(console, record)
    console.print()
    _print_regenerated(console, record)
    console.print()
    _print_ratios(console, record)
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
            _number(limit),
            f"{limit / ms['median']:.0%}" if ms["median"] > 0 else "",
            f"  [dim]{LIMITS[stage].by}[/]",
        )
    total = sum(limit["median"] for limit in limits.values())
    table.add_row("frame", *_times(frame), "", _number(total), f"{total / rest:.0%}", "  [dim]their sum[/]")
    console.print(table)


def _times(ms: Spread) -> list[str]:
    return [_number(ms[name]) for name in ("median", "q1", "q3")]


def _number(ms: float) -> str:
    """Milliseconds; those of graphics cards need more digits."""
    return f"{ms:,.1f}" if ms >= 100 else f"{ms:,.2f}" if ms >= 2 else f"{ms:,.4f}"


def _print_host(console: Console, record: Record) -> None:
    """What the host has to do with it, where a device computes."""
    if "host_ms" in record:
        host, wall = (_number(record[name]["median"]) for name in ("host_ms", "wall_ms"))
        console.print(f"by the device's clock; the host needs {host} ms to hand it over, and has it after {wall} ms")


def _print_regenerated(console: Console, record: Record) -> None:
    table = _table(f"all made anew, {vpls_of(record)} lights", "ms", "q1", "q3", "VPLs", "construction", "rest")
    for name, found in record["regenerated"]["frames"].items():
        stages = {stage: ms["median"] for stage, ms in found["stages_ms"].items()}
        lights, build = stages.pop("trace_vpls"), stages.pop("build_hierarchy")
        parts = [_number(ms) for ms in (lights, build, sum(stages.values()))]
        table.add_row(name, *_times(found["frame_ms"]), *parts)
    console.print(table)


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


def _print_ratios(console: Console, record: Record) -> None:
    table = _table("ratio", "value")
    aims = record["engine"] == "cpu"  # they are of two cores
    table.add_column("  aim" if aims else "")
    table.add_column("is", overflow="fold")
    for name, value in record["ratios"].items():
        shown, definition = "-" if value is None else f"{value:.3g}", RATIOS[name]
        aim = f"  {escape(definition.aim)}" if aims else " "
        table.add_row(name, f"[bold]{shown}[/]", aim, f"[dim]{escape(definition.formula)}[/]")
    console.print(table)


def _print_sweep(console: Console, name: str, found: Record) -> None:
    stages = list(found["stages_ms"][0])
    table = _table(name, "frame ms", *stages)
    for value, frame, ms in zip(found["values"], found["frame_ms"], found["stages_ms"], strict=True):
        row = [_number(frame["median"]), *(_number(ms[stage]["median"]) for stage in stages)]
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
            _number(change.before["median"]),
            _number(change.now["median"]),
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
