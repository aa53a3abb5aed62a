"""``lab params``: every setting, from the one place that defines them."""

from __future__ import annotations

import argparse
import json
import sys

from lab.params import PRESETS, SETTINGS, Params, Value, preset


def run(args: argparse.Namespace) -> None:
    """Prints the settings as a table, or as JSON."""
    if args.json:
        sys.stdout.write(json.dumps(settings(), indent=2) + "\n")
    else:
        _print_table()


def settings() -> list[dict[str, object]]:
    """One row a setting, in order: name, default, allowed, unit, symbol, section, doc and its value in each preset."""
    defaults = Params().to_dict()
    presets = {name: preset(name).to_dict() for name in PRESETS}
    return [
        {
            "name": name,
            "type": setting.kind.__name__,
            "default": defaults[name],
            "allowed": setting.allowed(),
            "unit": setting.unit,
            "symbol": setting.symbol,
            "section": setting.section,
            "doc": setting.doc,
            "presets": {preset_name: values[name] for preset_name, values in presets.items()},
        }
        for name, setting in SETTINGS.items()
    ]


def _print_table() -> None:
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    defaults = Params().to_dict()
    others = {name: preset(name).to_dict() for name, changes in PRESETS.items() if changes}
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("setting", "default", *others, "allowed", "what it is"):
        table.add_column(title, no_wrap=title == "setting")
    for name, setting in SETTINGS.items():
        origin = ", ".join(part for part in (setting.symbol, setting.section) if part)
        unit = f", in units of {setting.unit}" if setting.unit else ""
        changed = [_word(values[name]) if values[name] != defaults[name] else "" for values in others.values()]
        table.add_row(
            f"[bold]{name}[/]",
            _word(defaults[name]),
            *changed,
            escape(setting.allowed()),
            escape(f"{setting.doc}{unit}") + (f" [dim]({escape(origin)})[/]" if origin else ""),
        )
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=180)
    console.print(table)
    console.print(
        "Change them with --set NAME=VALUE; an empty cell under a preset means the default. LY19: Lin & Yuksel 2019."
    )


def _word(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
