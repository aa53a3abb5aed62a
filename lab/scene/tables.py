"""Cameras, lights and material overrides as tables of keys and values: shared by scene.toml and the JSON sidecars."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from lab.errors import LabError, nearest
from lab.scene.parts import Parts
from lab.scene.scene import Camera, PointLight, SpotLight, SunLight
from lab.scene.values import direction, flag, number, shown, vector, word

_MOST = 1e30  # of a light's colour: its square still fits a double


def table(where: str, value: object, allowed: Iterable[str], needed: Iterable[str] = ()) -> dict[str, Any]:
    """`value` as a table that has every `needed` key and none beyond `allowed`, or :class:`LabError` naming `where`."""
    if not isinstance(value, dict):
        raise LabError(f"{where} is {shown(value)}: it must be a table of keys and values")
    names = [*needed, *(name for name in allowed if name not in needed)]
    for key in value:
        if key not in names:
            raise LabError(f"{where}: unknown key {key!r}{nearest(str(key), names)}; known are {', '.join(names)}")
    for key in needed:
        if key not in value:
            raise LabError(f"{where}: the key {key!r} is missing; needed are {', '.join(needed)}")
    return value


def tables(where: str, value: object) -> list[tuple[str, object]]:
    """`value`, a list, as (place, item) pairs; the place counts from 1 as people do."""
    if not isinstance(value, list):
        key = where.rpartition(" ")[2]
        raise LabError(f"{where} is {shown(value)}: it must be a list of tables ([[{key}]] in a scene.toml)")
    return [(f"{where} {k}", item) for k, item in enumerate(value, start=1)]


def add_camera(parts: Parts, where: str, value: object, extra: tuple[str, ...] = ()) -> None:
    """Adds the camera in table `value`; keys named in `extra` are let pass."""
    given = table(where, value, ("up", "fov_y_deg", *extra), ("name", "eye", "target"))
    name = word(f"{where}: name", given["name"])
    if any(camera.name == name for camera in parts.cameras):
        raise LabError(f"{where}: there is a camera {name!r} already; names must differ")
    eye, target = vector(f"{where}: eye", given["eye"]), vector(f"{where}: target", given["target"])
    up = vector(f"{where}: up", given.get("up", [0, 1, 0]))
    fov = number(f"{where}: fov_y_deg", given.get("fov_y_deg", 45))
    try:
        parts.cameras.append(Camera(name, eye, target, up, fov))
    except LabError as problem:
        raise LabError(f"{where}: {problem}") from problem


def add_light(parts: Parts, where: str, kind: str, value: object) -> None:
    """Adds the light of `kind` (sun, point or spot) in table `value`."""
    if kind == "sun":
        given = table(where, value, (), ("to_sun", "irradiance"))
        irradiance = vector(f"{where}: irradiance", given["irradiance"], 0, _MOST)
        parts.suns.append(SunLight(direction(f"{where}: to_sun", given["to_sun"]), irradiance))
    elif kind == "point":
        given = table(where, value, (), ("position", "intensity"))
        position = vector(f"{where}: position", given["position"])
        parts.points.append(PointLight(position, vector(f"{where}: intensity", given["intensity"], 0, _MOST)))
    elif kind == "spot":
        given = table(where, value, ("inner_angle_deg", "outer_angle_deg"), ("position", "direction", "intensity"))
        outer = number(f"{where}: outer_angle_deg", given.get("outer_angle_deg", 45), 0, 90, open_low=True)
        inner = number(f"{where}: inner_angle_deg", given.get("inner_angle_deg", 0), 0, 90)
        if inner >= outer:
            raise LabError(f"{where}: inner_angle_deg is {inner:g}, it must be under outer_angle_deg, {outer:g}")
        position = vector(f"{where}: position", given["position"])
        toward = direction(f"{where}: direction", given["direction"])
        intensity = vector(f"{where}: intensity", given["intensity"], 0, _MOST)
        parts.spots.append(SpotLight(position, toward, intensity, math.radians(inner), math.radians(outer)))
    else:
        raise LabError(f"{where}: type is {shown(kind)}: it must be sun, point or spot")


def override_material(parts: Parts, where: str, value: object) -> None:
    """Changes every material with the name in table `value`: base_colour, emission, two_sided, alpha_cutoff."""
    given = table(where, value, ("base_colour", "emission", "two_sided", "alpha_cutoff"), ("name",))
    changes: dict[str, Any] = {}
    if "base_colour" in given:
        changes["base_colour"] = vector(f"{where}: base_colour", given["base_colour"], 0, 1)
    if "emission" in given:
        changes["emission"] = vector(f"{where}: emission", given["emission"], 0, _MOST)
    if "two_sided" in given:
        changes["two_sided"] = flag(f"{where}: two_sided", given["two_sided"])
    if "alpha_cutoff" in given:
        changes["alpha_cutoff"] = number(f"{where}: alpha_cutoff", given["alpha_cutoff"], 0, 1)
    change_material(parts, where, word(f"{where}: name", given["name"]), changes)


def change_material(parts: Parts, where: str, name: str, changes: dict[str, Any]) -> None:
    """Puts `changes` on every material called `name`; :class:`LabError` where there is none."""
    names = [material.name for material in parts.materials]
    if name not in names:
        known = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
        raise LabError(f"{where}: there is no material {name!r}{nearest(name, names)}; there are {known or 'none'}")
    parts.materials = [replace(m, **changes) if m.name == name else m for m in parts.materials]
