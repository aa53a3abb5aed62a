"""Giving a program its parameters: every name, every type and every size is checked.

slangpy ignores names that a program does not have, and says nothing of what was left unbound. Here either raises
:class:`~lab.engine.vulkan.reflection.ShaderError`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.buffers import DeviceBuffer
from lab.engine.vulkan.reflection import ShaderError, describe, dtype_of, is_varying, same_layout, scalar_name
from lab.errors import nearest

if TYPE_CHECKING:
    import slangpy as spy

Write = Callable[[Any], None]


class Bindings:
    """The parameters of one linked program, and a root object to bind them to, which is used again and again.

    What a dispatch uses is taken from the root object as the dispatch is recorded, so it may change right after.
    """

    def __init__(self, device: spy.Device, program: spy.ShaderProgram, title: str) -> None:
        spy = import_slangpy()
        self.title = title
        self.root = device.create_root_shader_object(program)
        # Cursors point into the root object, which must outlive them.
        self._cursor = spy.ShaderCursor(self.root)
        self._writes: dict[str, Write] = {}
        self._written: dict[str, Any] = {}
        layout = program.layout
        for i in range(len(layout.parameters)):
            self._add(layout.parameters[i], self._cursor)
        stages = spy.ShaderStage.compute, spy.ShaderStage.vertex, spy.ShaderStage.fragment
        for number in range(len(layout.entry_points)):
            entry = layout.entry_points[number]
            if entry.stage not in stages:
                continue  # parameters of ray entry points are payloads and attributes
            for i in range(len(entry.parameters)):
                if not is_varying(entry.parameters[i]):
                    self._add(entry.parameters[i], self._cursor.find_entry_point(number))

    @property
    def names(self) -> list[str]:
        """The parameters, in the shader's order."""
        return list(self._writes)

    def set(self, values: Mapping[str, Any]) -> None:
        """Binds all parameters: `values` must name each of them, and nothing else."""
        if values.keys() != self._writes.keys():
            self._refuse(values)
        for name, write in self._writes.items():
            value = values[name]
            if not _unchanged(self._written.get(name), value):
                self._written.pop(name, None)
                write(value)
                self._written[name] = _remembered(value)

    def _refuse(self, values: Mapping[str, Any]) -> None:
        for name in values:
            if name not in self._writes:
                known = ", ".join(self.names)
                raise ShaderError(
                    f"{self.title} has no parameter {name!r}{nearest(name, self._writes)}; it has {known}"
                )
        missing = [name for name in self._writes if name not in values]
        if missing:
            raise ShaderError(f"{self.title}: nothing was given for {', '.join(missing)}")

    def _add(self, parameter: spy.VariableLayoutReflection, cursor: spy.ShaderCursor) -> None:
        name = parameter.name
        if name in self._writes:
            raise ShaderError(f"{self.title} has two parameters called {name}")
        self._writes[name] = _writer(f"{self.title}: {name}", parameter.type_layout, cursor, name)


_PLAIN = (bool, int, float, tuple)


class _Parts(dict[str, Any]):
    """What is remembered of a struct that holds more than numbers; never a buffer itself, which must go back."""


def _remembered(value: Any) -> Any:
    """What tells whether a value is the same as the last time; None where it must be written anew."""
    if isinstance(value, DeviceBuffer):
        return value.raw, value.dtype
    if isinstance(value, dict):
        plain = all(isinstance(part, _PLAIN) for part in value.values())
        return dict(value) if plain else _Parts({name: _remembered(part) for name, part in value.items()})
    return value if isinstance(value, _PLAIN) else None


def _unchanged(last: Any, value: Any) -> bool:
    if isinstance(value, DeviceBuffer):
        return isinstance(last, tuple) and last[0] is value.raw and last[1] is value.dtype
    if isinstance(last, _Parts):
        same = isinstance(value, dict) and last.keys() == value.keys()
        return same and all(_unchanged(last[name], part) for name, part in value.items())
    return last is not None and type(last) is type(value) and bool(last == value)


def _writer(title: str, layout: spy.TypeLayoutReflection, cursor: spy.ShaderCursor, name: str) -> Write:
    """What puts a value into parameter `name` of `cursor`, after checking that it is of its type."""
    spy = import_slangpy()
    kinds = spy.TypeReflection.Kind
    makers: dict[Any, Callable[[], Write]] = {
        kinds.resource: lambda: _resource_writer(title, layout, cursor, name),
        kinds.pointer: lambda: _buffer_writer(title, dtype_of(layout.element_type_layout), cursor, name, pointer=True),
        kinds.sampler_state: lambda: _object_writer(title, spy.Sampler, cursor, name),
        kinds.constant_buffer: lambda: _fields_writer(title, layout.element_type_layout, cursor[name].dereference()),
        kinds.struct: lambda: _fields_writer(title, layout, cursor[name]),
        kinds.scalar: lambda: _number_writer(title, scalar_name(layout), cursor, name),
        kinds.vector: lambda: _vector_writer(title, layout, cursor, name),
    }
    if layout.kind not in makers:
        raise ShaderError(f"{title} is a {layout.kind.name}, which nothing can be bound to")
    return makers[layout.kind]()


def _resource_writer(title: str, layout: spy.TypeLayoutReflection, cursor: spy.ShaderCursor, name: str) -> Write:
    spy = import_slangpy()
    shapes, shape = spy.TypeReflection.ResourceShape, layout.type.resource_shape
    if shape == shapes.structured_buffer:
        return _buffer_writer(title, dtype_of(layout.element_type_layout), cursor, name)
    wanted = spy.AccelerationStructure if shape == shapes.acceleration_structure else (spy.Texture, spy.TextureView)
    return _object_writer(title, wanted, cursor, name)


def _buffer_writer(
    title: str, element: np.dtype[Any], cursor: spy.ShaderCursor, name: str, *, pointer: bool = False
) -> Write:
    """Of a buffer, or of a `pointer` to its first row, of which slangpy knows nothing: barriers are the caller's."""

    def write(value: Any) -> None:
        if not isinstance(value, DeviceBuffer):
            raise ShaderError(f"{title} takes a DeviceBuffer, got {type(value).__name__}")
        if value.dtype is not element and not same_layout(value.dtype, element):
            raise ShaderError(
                f"{title}: the shader reads rows of {describe(element)}, buffer {value.label!r} has rows of "
                f"{describe(value.dtype)}"
            )
        cursor[name] = value.raw.device_address if pointer else value.raw

    return write


def _object_writer(title: str, wanted: Any, cursor: spy.ShaderCursor, name: str) -> Write:
    def write(value: Any) -> None:
        if not isinstance(value, wanted):
            raise ShaderError(f"{title} takes {wanted}, got {type(value).__name__}")
        cursor[name] = value

    return write


def _fields_writer(title: str, layout: spy.TypeLayoutReflection, cursor: spy.ShaderCursor) -> Write:
    """Of a struct: its values come as a mapping that names every field and nothing else."""
    fields = [layout.fields[i] for i in range(len(layout.fields))]
    writes = {field.name: _writer(f"{title}.{field.name}", field.type_layout, cursor, field.name) for field in fields}

    def write(value: Any) -> None:
        if not isinstance(value, Mapping):
            raise ShaderError(f"{title} takes a mapping of its fields, got {type(value).__name__}")
        wrong = [name for name in value if name not in writes] + [name for name in writes if name not in value]
        if wrong:
            raise ShaderError(f"{title}: fields {', '.join(wrong)} are unknown or missing; it has {', '.join(writes)}")
        for name, one in writes.items():
            one(value[name])

    return write


def _number_writer(title: str, scalar: str, cursor: spy.ShaderCursor, name: str) -> Write:
    convert = bool if scalar == "bool" else float if scalar.startswith("float") else int

    def write(value: Any) -> None:
        if not isinstance(value, (bool, int, float, np.generic)) or (convert is int and value != int(value)):
            raise ShaderError(f"{title} takes a number ({scalar}), got {value!r}")
        cursor[name] = convert(value)

    return write


def _vector_writer(title: str, layout: spy.TypeLayoutReflection, cursor: spy.ShaderCursor, name: str) -> Write:
    spy = import_slangpy()
    scalar, count = scalar_name(layout), layout.type.col_count
    prefix = {"float32": "float", "int32": "int", "uint32": "uint"}.get(scalar)
    if prefix is None:
        raise ShaderError(f"{title}: vectors of {scalar} can't be bound")
    vector = getattr(spy, f"{prefix}{count}")
    number = float if prefix == "float" else int

    def write(value: Any) -> None:
        if not isinstance(value, (Sequence, np.ndarray)) or len(value) != count:
            raise ShaderError(f"{title} takes {count} numbers, got {value!r}")
        cursor[name] = vector(*map(number, value))

    return write
