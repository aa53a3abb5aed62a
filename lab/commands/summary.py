"""What a run tells at its end: files, times, counts and the loader's notes, on stdout."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from lab.report import Record


def print_summary(record: Record, paths: list[Path]) -> None:
    """Prints a finished run for people."""
    console = Console(highlight=False, soft_wrap=True)
    scene, counts = record["scene"], record["counts"]
    width, height = scene["size"]
    console.print(
        f"[bold]{escape(scene['name'])}[/] {width}x{height}, {scene['triangles']:,} triangles, "
        f"{counts['vpls']:,} lights, preset {record['preset']}, seed {record['params']['seed']}: "
        f"[bold]{_total(record['total_ms'])}[/] after {record['load_ms'] / 1e3:.2f} s of loading, {_by(record)}"
    )
    console.print(_stages(record))
    console.print(_levels(counts["levels"]))
    for note in record["notes"]:
        console.print(f"note: {escape(note)}")
    console.print(f"wrote {', '.join(escape(str(path)) for path in paths)}")


def _by(record: Record) -> str:
    """What computed, by whose clock."""
    device, threads = record["device"], record["machine"]["threads"]
    if device is None:
        return f"{threads} thread{'' if threads == 1 else 's'}"
    return f"by the clock of {escape(device['name'])}"


def _stages(record: Record) -> Table:
    table = Table("stage", box=None, pad_edge=False)
    table.add_column("ms", justify="right")
    table.add_column("share", justify="right")
    for stage, ms in record["stages_ms"].items():
        table.add_row(stage, _milliseconds(ms), f"{ms / max(record['total_ms'], 1e-9):.0%}")
    return table


def _total(ms: float) -> str:
    return f"{ms / 1e3:.2f} s" if ms >= 1e3 else f"{ms:.2f} ms"


def _milliseconds(ms: float) -> str:
    """Graphics cards take less than one for many a stage."""
    return f"{ms:,.1f}" if ms >= 10 else f"{ms:,.3f}" if ms < 1 else f"{ms:,.2f}"


def _levels(levels: list[Record]) -> Table:
    table = Table("level", box=None, pad_edge=False)
    for name in ("cell size", "grid lights", "overdraw", "lights used"):
        table.add_column(name, justify="right")
    for row in levels:
        table.add_row(
            str(row["level"]),
            f"{row['cell_size']:.4g}",
            f"{row['grid_lights']:,}",
            f"{row['overdraw_mean']:.2f}",
            f"{row['lights_used_mean']:.2f}",
        )
    return table
