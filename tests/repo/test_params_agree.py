"""Params, the C++ struct and what people read about the settings are the same."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from lab.commands.params import settings
from lab.params import PRESETS, SETTINGS, Params, preset

from .project import ROOT, text

HEADER = Path("core_cpp/include/lab/params.h")
SHADER = Path("shaders/lib/params.slang")


def header_fields() -> dict[str, tuple[str, str]]:
    """name -> (type, default) as written in the C++ struct."""
    rows = re.findall(r"^\s*X\(([\w:]+), (\w+), ([^)]+)\)", text(HEADER), flags=re.MULTILINE)
    return {name: (kind, default) for kind, name, default in rows}


def header_words(kind: str) -> list[str]:
    """The words of an enumeration, as C++ spells them."""
    found = re.search(rf"words_of<{kind}>\{{([^}}]*)\}}", text(HEADER))
    return re.findall(r'"(\w+)"', found[1]) if found else []


def test_the_struct_has_the_same_settings_in_the_same_order() -> None:
    assert list(header_fields()) == [field.name for field in fields(Params)]


def test_the_core_has_the_same_defaults_and_types() -> None:
    from lab import _core

    ours, core = Params().to_core(), _core.default_params()
    assert list(core) == list(ours)
    assert {name: type(value) for name, value in core.items()} == {name: type(value) for name, value in ours.items()}
    for name, value in ours.items():
        # The struct holds float32: 0.3 there is its nearest float.
        assert core[name] == (pytest.approx(value, rel=1e-7) if isinstance(value, float) else value), name


@pytest.mark.parametrize("name", [name for name, setting in SETTINGS.items() if setting.kind is str])
def test_choices_are_spelled_alike(name: str) -> None:
    from lab import _core

    assert header_words(header_fields()[name][0]) == list(SETTINGS[name].choices)
    assert list(_core.choices()[name]) == list(SETTINGS[name].choices)


def shader_fields() -> dict[str, str]:
    """name -> type as written in the shaders' struct."""
    struct = text(SHADER).partition("public struct Params")[2]
    return {name: kind for kind, name in re.findall(r"^ +public (\w+) (\w+);", struct, flags=re.MULTILINE)}


def test_the_shaders_have_the_same_settings_in_the_same_order() -> None:
    spelled = {"std::int64_t": "int64_t", "std::uint32_t": "uint"}
    core = {name: spelled.get(kind, kind) for name, (kind, _) in header_fields().items()}
    assert list(shader_fields().items()) == list(core.items())


@pytest.mark.parametrize("name", [name for name, setting in SETTINGS.items() if setting.kind is str])
def test_choices_are_numbered_alike(name: str) -> None:
    found = re.search(rf"public enum {shader_fields()[name]} : int\n\{{([^}}]*)\}}", text(SHADER))
    assert found
    assert re.findall(r"\w+", found[1]) == list(SETTINGS[name].choices)


def test_the_settings_that_people_see_are_all_and_only_these() -> None:
    rows = {row["name"]: row for row in settings()}
    assert list(rows) == list(SETTINGS)
    for name, row in rows.items():
        assert row["default"] == Params().to_dict()[name]
        assert row["presets"] == {p: preset(p).to_dict()[name] for p in PRESETS}
        assert row["doc"] and row["allowed"]


def test_the_readme_names_no_setting_that_is_not() -> None:
    """Every ``--set name=value`` in the documentation and in the help of the commands is accepted."""
    pages = [path for path in (ROOT / "README.md", ROOT / "lab/cli.py", ROOT / "Makefile") if path.is_file()]
    assigned = [
        tuple(pair.split("="))
        for page in pages
        for run in re.findall(r"--set((?:[ =]\w+=[\w.]+)+)", page.read_text(encoding="utf-8"))
        for pair in run.split()
        if "=" in pair and not pair.startswith("=")
    ]
    assert assigned
    for name, value in assigned:
        if name.isupper():  # NAME=VALUE, the form itself
            continue
        Params().replace(**{name: value})
