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
    (width, height), threads = scene["size"], record["machine"]["threads"]
    console.print(
        f"[bold]{escape(scene['name'])}[/] {width}x{height}, {scene['triangles']:,} triangles, "
        f"{counts['vpls']:,} lights, preset {record['preset']}, seed {record['params']['seed']}: "
        f"[bold]{record['total_ms'] / 1e3:.2f} s[/] after {record['load_ms'] / 1e3:.2f} s of loading, "
        f"{threads} thread{'' if threads == 1 else 's'}"
    )
    console.print(_stages(record))
    console.print(_levels(counts["levels"]))
    for note in record["notes"]:
        console.print(f"note: {escape(note)}")
    console.print(f"wrote {', '.join(escape(str(path)) for path in paths)}")


def _stages(record: Record) -> Table:
    table = Table("stage", box=None, pad_edge=False)
    table.add_column("ms", justify="right")
    table.add_column("share", justify="right")
    for stage, ms in record["stages_ms"].items():
        table.add_row(stage, f"{ms:,.1f}", f"{ms / max(record['total_ms'], 1e-9):.0%}")
    return table


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
