"""``lab info``: versions, the machine, and what is installed; works with the core alone."""

from __future__ import annotations

import argparse
import re
from importlib import metadata
from importlib.util import find_spec
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from lab import __version__
from lab.errors import LabError
from lab.report import machine


def run(args: argparse.Namespace) -> None:
    """Prints the tables."""
    console = Console(highlight=False, soft_wrap=True)
    table = Table(show_header=False, box=None, pad_edge=False)
    rows: dict[str, object] = {"lab": __version__, **machine(), **core_info()}
    for name, value in rows.items():
        table.add_row(name, escape(str(value)))
    console.print(table)
    console.print()
    extras = Table("package", "version", "part of", box=None, pad_edge=False)
    for package, installed, part in packages():
        extras.add_row(package, installed or "[yellow]missing[/]", escape(part))
    console.print(extras)
    console.print()
    for line in vulkan_devices():
        console.print(escape(line))
    for extra in missing_extras():
        console.print(f"extra '{extra}' is not complete; install it with  make setup EXTRA={extra}")


def core_info() -> dict[str, Any]:
    """What the compiled core says about itself, or how to build it."""
    if find_spec("lab._core") is None:
        return {"core": "not built; run 'make setup'"}
    from lab import _core
    from lab.engine.simd import use_simd_of_environment

    use_simd_of_environment()
    return {name: ", ".join(value) if isinstance(value, list) else value for name, value in _core.info().items()}


def vulkan_devices() -> list[str]:
    """A line for each Vulkan device: its number, its name, and what it lacks; or why there is none."""
    if find_spec("slangpy") is None:
        return ["vulkan: needs slangpy (below)"]
    from lab.engine.vulkan.adapters import SOFTWARE, survey_adapters

    try:
        adapters = survey_adapters()
    except LabError as error:
        return [f"vulkan: {error}"]
    lines = []
    for adapter in adapters:
        lacks = ", ".join(adapter.lacks or ())
        state = f"can't be used: {adapter.problem}" if adapter.problem else f"lacks {lacks}" if lacks else "ready"
        lines.append(f"vulkan device {adapter.index}: {adapter.name}: {state}")
    return lines or [f"vulkan: no device; install your graphics card's driver, or: {SOFTWARE}"]


def packages() -> list[tuple[str, str, str]]:
    """(package, installed version or "", "lab" or the extra that brings it) of every declared dependency."""
    rows = []
    for name, extra in _requirements():
        try:
            installed = metadata.version(name)
        except metadata.PackageNotFoundError:
            installed = ""
        rows.append((name, installed, f"extra {extra}" if extra else "lab"))
    return rows


def missing_extras() -> list[str]:
    """Extras of which at least one package is missing."""
    return sorted({part.removeprefix("extra ") for _, installed, part in packages() if not installed and part != "lab"})


def _requirements() -> list[tuple[str, str]]:
    try:
        declared = metadata.requires("many-lights-lab") or []
    except metadata.PackageNotFoundError:
        return []
    rows: dict[str, str] = {}
    for requirement in declared:
        name = re.split(r"[^\w.-]", requirement.strip(), maxsplit=1)[0]
        marker = re.search(r"extra == ['\"]([\w-]+)['\"]", requirement)
        extra = marker[1] if marker else ""
        if extra != "all" and name != "many-lights-lab":
            rows.setdefault(name, extra)
    return list(rows.items())
