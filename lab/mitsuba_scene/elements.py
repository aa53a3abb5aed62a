"""Elements of Mitsuba's XML: ``<float name="fov" value="45"/>`` and the like."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

import numpy as np


def number(value: float) -> str:
    """`value` with every digit that float32 holds."""
    return f"{float(np.float32(value)):.9g}"


def numbers(values: Iterable[float]) -> str:
    """``x, y, z``."""
    return ", ".join(number(value) for value in values)


def child(parent: Element, tag: str, kind: str = "", name: str = "") -> Element:
    """``<tag type="kind" name="name">`` under `parent`; empty attributes are left out."""
    found = SubElement(parent, tag)
    if kind:
        found.set("type", kind)
    if name:
        found.set("name", name)
    return found


def put(parent: Element, name: str, value: bool | int | float | str) -> None:
    """A plain parameter; its tag follows from the type of `value`. A text beginning with $ is a number given later."""
    match value:
        case bool():
            tag, text = "boolean", str(value).lower()
        case int():
            tag, text = "integer", str(value)
        case float():
            tag, text = "float", number(value)
        case str():
            tag, text = ("integer" if value.startswith("$") else "string"), value
    child(parent, tag, name=name).set("value", text)


def put_rgb(parent: Element, name: str, colour: Iterable[float]) -> None:
    """A linear RGB colour."""
    child(parent, "rgb", name=name).set("value", numbers(colour))


def put_point(parent: Element, tag: str, name: str, values: Iterable[float]) -> None:
    """A ``point`` or ``vector``."""
    found = child(parent, tag, name=name)
    for axis, value in zip("xyz", values, strict=True):
        found.set(axis, number(value))


def put_lookat(
    parent: Element, origin: Iterable[float], target: Iterable[float], up: Iterable[float], scale: float = 1.0
) -> None:
    """The transform ``to_world`` that puts something at `origin`, its z axis toward `target`."""
    transform = child(parent, "transform", name="to_world")
    if scale != 1.0:
        child(transform, "scale").set("value", number(scale))
    look = child(transform, "lookat")
    look.set("origin", numbers(origin))
    look.set("target", numbers(target))
    look.set("up", numbers(up))
