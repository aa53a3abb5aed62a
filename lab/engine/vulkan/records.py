"""The records of :mod:`lab.records` with their data on the device.

A device record is a record: its fields are numpy arrays, but they are read back when somebody first looks at them, and
never if nobody does. The stages of this engine look at :func:`parts` instead, the buffers themselves.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeVar

R = TypeVar("R")

_PARTS, _MAKERS, _READ = "_device_parts", "_device_makers", "_device_read"


def device_record(kind: type[R], parts: Any, fields: Mapping[str, Callable[[], Any]]) -> R:
    """A record of `kind` over `parts` (whatever the engine's stages need of it).

    `fields` has for each field of the record what reads it back; it is called once at most.
    """
    names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
    if sorted(names) != sorted(fields):
        raise ValueError(f"{kind.__name__} has the fields {', '.join(names)}; got {', '.join(fields)}")
    made: Any = kind
    record = object.__new__(_device_class(made))
    object.__setattr__(record, _PARTS, parts)
    object.__setattr__(record, _MAKERS, dict(fields))
    object.__setattr__(record, _READ, {})
    return record  # type: ignore[no-any-return]


def parts(record: Any) -> Any:
    """What a record of this engine consists of on the device; None for any other record."""
    return getattr(record, _PARTS, None)


@cache
def _device_class(kind: Any) -> Any:
    """A subclass of `kind` whose fields read themselves back; `dataclasses.replace` makes a plain `kind` of it."""

    def field(name: str) -> property:
        def get(self: Any) -> Any:
            read: dict[str, Any] = getattr(self, _READ)
            if name not in read:
                read[name] = getattr(self, _MAKERS)[name]()
            return read[name]

        return property(get)

    def plain(_: type[Any], *values: Any, **named: Any) -> Any:
        return kind(*values, **named)

    names = [field.name for field in dataclasses.fields(kind)]
    body = {name: field(name) for name in names}
    return type(kind)(f"Device{kind.__name__}", (kind,), body | {"__new__": plain, "__init__": _nothing})


def _nothing(self: Any, *values: Any, **named: Any) -> None:
    """Its fields are set already."""
