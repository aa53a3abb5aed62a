"""The saved state of the inspector: what goes out comes in again, and what is damaged says what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from gui.view_state import PANELS, ViewState, parse_view_state, read_view_state, write_view_state
from lab import LabError, Params

FULL = ViewState(
    scene="a/b.glb", sun="0,1,0.5", preset="paper", params=Params(alpha=2, levels=4).to_dict(), camera="1,2,3:4,5,6",
    size=(320, 200), layer="overdraw", other_source="reference:brute_force", other_layer="indirect", compare="wipe",
    wipe=0.25, exposure=-1.5, colour_map="viridis", log_scale=True, zoom=4.0, centre=(0.1, 0.9), mesh="textured",
    opacity=0.5, vpls=True, levels=(0, 3), colour_by="level", cells=2, scene_camera=(1, 2, 3, 4, 5, 6, 0, 1, 0),
    pixel=(12, 34), light=77, panel="leaks", split="image",
)  # fmt: skip


def test_a_state_comes_back_as_it_went(tmp_path: Path) -> None:
    for state in (FULL, ViewState(scene="x")):
        write_view_state(tmp_path / "s.json", state)
        assert read_view_state(tmp_path / "s.json") == state
    assert [path.name for path in tmp_path.iterdir()] == ["s.json"]


DAMAGE: dict[str, tuple[dict[str, Any], str]] = {
    "an unknown name": ({"lyaer": "colour"}, "did you mean 'layer'"),
    "a word for a number": ({"wipe": "left"}, "a number from 0 to 1"),
    "not a number": ({"wipe": float("nan")}, "wipe=nan"),
    "too far": ({"zoom": 1e9}, "zoom"),
    "true for a number": ({"cells": True}, "cells"),
    "half a pixel": ({"pixel": [1.5, 2]}, "pixel"),
    "one coordinate": ({"pixel": [1]}, "2 values"),
    "a negative pixel": ({"pixel": [-1, 2]}, "pixel"),
    "a huge picture": ({"size": [100000, 2]}, "size"),
    "a number for words": ({"camera": 3}, "camera=3"),
    "an unknown panel": ({"panel": "pixels"}, "did you mean 'pixel'"),
    "an unknown preset": ({"preset": "papers"}, "'paper'"),
    "an unknown setting": ({"params": {"alhpa": 2}}, "'alpha'"),
    "a refused setting": ({"params": {"alpha": 0}}, "alpha=0"),
    "settings as a list": ({"params": [1]}, "settings by name"),
    "six numbers of a view": ({"scene_camera": [1, 2, 3, 4, 5, 6]}, "9 values"),
    "another format": ({"inspector": 99}, "format 99"),
    "no scene": ({"scene": None}, "scene"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_named(name: str) -> None:
    change, hint = DAMAGE[name]
    values = json.loads(FULL.to_json()) | change
    with pytest.raises(LabError, match="saved") as caught:
        parse_view_state(json.dumps(values), "saved")
    assert hint in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", "null", '{"scene": "x"}', "\x00", "[" * 100_000])
def test_other_files_are_no_states(text: str) -> None:
    with pytest.raises(LabError, match="saved: is no"):
        parse_view_state(text, "saved")


def test_missing_and_binary_files(tmp_path: Path) -> None:
    with pytest.raises(LabError, match="can't be read"):
        read_view_state(tmp_path / "none.json")
    (tmp_path / "b.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LabError, match="not a text file"):
        read_view_state(tmp_path / "b.json")


def test_every_panel_can_be_saved() -> None:
    for panel in PANELS:
        assert parse_view_state(ViewState(scene="x", panel=panel).to_json(), "s").panel == panel
