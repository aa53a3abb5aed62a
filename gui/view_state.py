"""The whole state of the inspector as one record: what is rendered, and what is shown of it. Saved as JSON."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lab.errors import LabError, nearest
from lab.outputs import write_all
from lab.params import PRESETS, Params
from lab.report import read_json

FORMAT = 1

COMPARES = ("off", "wipe", "difference")
COLOUR_MAPS = ("heat", "magma", "viridis", "grey")
MESH_STYLES = ("textured", "grey", "none")
COLOUR_BYS = ("flux", "level", "deviation")
PANELS = ("pixel", "overdraw", "shadows", "leaks", "levels", "timings")
SPLITS = ("both", "image", "scene")
LONGEST_TEXT = 4096


@dataclass(frozen=True)
class ViewState:
    """Everything that makes the inspector look as it does.

    Attributes:
        scene: path of the scene's file.    sun: direction given by hand, as text, or "".
        preset, params, engine: what is rendered; `params` are all settings by name.
        camera: a camera's name or eye:target[:up[:fov]]; "" is the scene's first.    size: pixels of the picture.
        layer: the layer shown.    other_source, other_layer: what it is compared with (see gui.sources).
        compare: off, wipe, or difference.    wipe: where the divider is, 0..1.
        exposure: stops over the automatic exposure.    colour_map, log_scale: of layers that are no light.
        zoom, centre: magnification (1: fit) and the point of the picture in the middle, 0..1 each.
        mesh, opacity, vpls, levels, colour_by, cells, legend: what the 3D view shows; `cells` -1 is none.
        scene_camera: position, focal point and up of the 3D view, nine numbers, or none to look from `camera`.
        pixel: the pixel that is probed, (x, y).    light: merged index of the selected grid light.
        panel, split: the panel that is open; which of picture and scene are shown.
    """

    scene: str
    sun: str = ""
    preset: str = "ours"
    params: dict[str, Any] = field(default_factory=lambda: Params().to_dict())
    engine: str = "cpu"
    camera: str = ""
    size: tuple[int, int] = (640, 360)
    layer: str = "colour"
    other_source: str = "render"
    other_layer: str = "unshadowed"
    compare: str = "off"
    wipe: float = 0.5
    exposure: float = 0.0
    colour_map: str = "heat"
    log_scale: bool = False
    zoom: float = 1.0
    centre: tuple[float, float] = (0.5, 0.5)
    mesh: str = "grey"
    opacity: float = 1.0
    vpls: bool = False
    levels: tuple[int, ...] = (1,)
    colour_by: str = "flux"
    cells: int = -1
    legend: bool = True
    scene_camera: tuple[float, ...] | None = None
    pixel: tuple[int, int] | None = None
    light: int | None = None
    panel: str = "pixel"
    split: str = "both"

    def __post_init__(self) -> None:
        for name, check in _CHECKS.items():
            object.__setattr__(self, name, check(name, getattr(self, name)))

    def to_json(self) -> str:
        """The text that :func:`read_view_state` reads."""
        return json.dumps({"inspector": FORMAT, **dataclasses.asdict(self)}, indent=1) + "\n"

    @classmethod
    def from_json(cls, values: object, source: str) -> ViewState:
        """A saved state; `source` is what messages call it. Errors: :class:`LabError` naming what is wrong."""
        if not isinstance(values, dict) or "inspector" not in values:
            raise LabError(f"{source}: is no saved state of the inspector (it would have the key 'inspector')")
        if values["inspector"] != FORMAT:
            raise LabError(f"{source}: has format {values['inspector']!r:.20}; this version reads format {FORMAT}")
        names = [f.name for f in dataclasses.fields(cls)]
        rest = {name: value for name, value in values.items() if name != "inspector"}
        for name in rest:
            if name not in names:
                raise LabError(f"{source}: {name!r:.60} is nothing the inspector saves{nearest(name, names)}")
        if "scene" not in rest:
            raise LabError(f"{source}: names no scene")
        try:
            return cls(**rest)
        except LabError as error:
            raise LabError(f"{source}: {error}") from None


def read_view_state(path: Path) -> ViewState:
    """The state saved in a file. Errors: :class:`LabError` where there is none, or it is damaged."""
    values = read_json("--state", path, "give a file that the inspector's 'save' has written")
    return ViewState.from_json(values, f"--state {path}")


def parse_view_state(text: str, source: str) -> ViewState:
    """The state in a text that was handed in."""
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        raise LabError(f"{source}: is no JSON; choose a file that 'save' has written") from None
    return ViewState.from_json(values, source)


def write_view_state(path: Path, state: ViewState) -> None:
    """Saves the state, never half."""

    def write(target: Path) -> None:
        target.write_text(state.to_json(), encoding="utf-8")

    write_all({path: write})


def _wrong(name: str, value: object, allowed: str) -> LabError:
    return LabError(f"{name}={value!r:.60}: allowed is {allowed}")


def _text(name: str, value: object) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_TEXT:
        raise _wrong(name, value, "text")
    return value


def _one_of(*choices: str) -> Any:
    def check(name: str, value: object) -> str:
        if value not in choices:
            raise LabError(f"{name}={value!r:.60}: allowed is {' | '.join(choices)}{nearest(str(value), choices)}")
        return str(value)

    return check


def _boolean(name: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise _wrong(name, value, "true or false")
    return value


def _real(low: float, high: float) -> Any:
    def check(name: str, value: object) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:  # type: ignore[operator]
            raise _wrong(name, value, f"a number from {low:g} to {high:g}")
        return float(value)  # type: ignore[arg-type]

    return check


def _whole(low: int, high: int) -> Any:
    def check(name: str, value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise _wrong(name, value, f"a whole number from {low} to {high}")
        return value

    return check


def _tuple_of(one: Any, *counts: int) -> Any:
    def check(name: str, value: object) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple) or (counts and len(value) not in counts):
            raise _wrong(name, value, f"a list of {' or '.join(map(str, counts)) or 'any number of'} values")
        return tuple(one(name, item) for item in value)

    return check


def _optional(inner: Any) -> Any:
    return lambda name, value: None if value is None else inner(name, value)


def _params(name: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _wrong(name, value, "the settings by name")
    return Params().replace(**{str(key): item for key, item in value.items()}).to_dict()


_SIDE = 4096
_FAR = 1e12
_CHECKS = {
    "scene": _text,
    "sun": _text,
    "preset": _one_of(*PRESETS),
    "params": _params,
    "engine": _one_of("cpu"),
    "camera": _text,
    "size": _tuple_of(_whole(16, _SIDE), 2),
    "layer": _text,
    "other_source": _text,
    "other_layer": _text,
    "compare": _one_of(*COMPARES),
    "wipe": _real(0, 1),
    "exposure": _real(-20, 20),
    "colour_map": _one_of(*COLOUR_MAPS),
    "log_scale": _boolean,
    "zoom": _real(0.1, 1024),
    "centre": _tuple_of(_real(-8, 8), 2),
    "mesh": _one_of(*MESH_STYLES),
    "opacity": _real(0, 1),
    "vpls": _boolean,
    "levels": _tuple_of(_whole(0, 12)),
    "colour_by": _one_of(*COLOUR_BYS),
    "cells": _whole(-1, 12),
    "legend": _boolean,
    "scene_camera": _optional(_tuple_of(_real(-_FAR, _FAR), 9)),
    "pixel": _optional(_tuple_of(_whole(0, _SIDE - 1), 2)),
    "light": _optional(_whole(0, 2**32 - 1)),
    "panel": _one_of(*PANELS),
    "split": _one_of(*SPLITS),
}
