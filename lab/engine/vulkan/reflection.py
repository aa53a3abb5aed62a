"""What a linked Slang program says about its parameters, and the numpy types that match its structs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lab.engine.vulkan.adapters import import_slangpy

if TYPE_CHECKING:
    import slangpy as spy

# Slang's name -> numpy's; a bool takes four bytes in buffers and uniforms, an enumeration is an int.
SCALARS = {
    "bool": "u4",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float16": "f2",
    "float32": "f4",
    "float64": "f8",
}


class ShaderError(Exception):
    """A program and what it is given do not fit together: a mistake in the engine's own code."""


def scalar_name(layout: spy.TypeLayoutReflection) -> str:
    """``float32``, ``bool``, ... of a scalar's, vector's or matrix' numbers."""
    return str(layout.type.scalar_type.name)


def is_varying(parameter: spy.VariableLayoutReflection) -> bool:
    """Whether an entry point's parameter is one of the system's values, not something to bind."""
    kinds = import_slangpy().TypeReflection.Kind
    layout = parameter.type_layout
    return layout.size == 0 and layout.kind in (kinds.scalar, kinds.vector, kinds.matrix)


def dtype_of(layout: spy.TypeLayoutReflection) -> np.dtype[Any]:
    """The numpy type of a scalar, vector, array or struct as this layout packs it."""
    kinds = import_slangpy().TypeReflection.Kind
    kind = layout.kind
    if kind == kinds.scalar:
        return np.dtype(SCALARS[scalar_name(layout)])
    if kind == kinds.vector:
        return np.dtype((np.dtype(SCALARS[scalar_name(layout)]), (layout.type.col_count,)))
    if kind == kinds.array:
        return np.dtype((dtype_of(layout.element_type_layout), (layout.type.element_count,)))
    if kind == kinds.struct:
        fields = [layout.fields[i] for i in range(len(layout.fields))]
        return np.dtype(
            {
                "names": [field.name for field in fields],
                "formats": [dtype_of(field.type_layout) for field in fields],
                "offsets": [field.offset for field in fields],
                "itemsize": layout.stride,
            }
        )
    raise ShaderError(f"type {layout.name} ({kind.name}) has no counterpart in numpy")


def describe(kind: np.dtype[Any]) -> str:
    """A type in words short enough for a message."""
    if kind.names is None:
        return str(kind)
    fields: dict[str, Any] = dict(kind.fields or {})
    parts = ", ".join(f"{name} {fields[name][0]} at {fields[name][1]}" for name in kind.names)
    return f"{kind.itemsize} bytes {{{parts}}}"


def same_layout(ours: np.dtype[Any], theirs: np.dtype[Any]) -> bool:
    """Whether rows of `ours` in memory are what a shader reads as `theirs`: names, types, places and size."""
    if ours.names is None or theirs.names is None:
        return ours == theirs
    a: dict[str, Any] = dict(ours.fields or {})
    b: dict[str, Any] = dict(theirs.fields or {})
    return (
        ours.names == theirs.names
        and ours.itemsize == theirs.itemsize
        and all(a[name][1] == b[name][1] and same_layout(a[name][0], b[name][0]) for name in ours.names)
    )
