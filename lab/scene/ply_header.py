"""The header of a PLY file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lab.errors import LabError

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")
_MAX_HEADER = 1 << 16


@dataclass(frozen=True)
class Column:
    """A column of an element: numpy types (without byte order) of its values and, for a list, of its length."""

    value: str
    length: str = ""


@dataclass(frozen=True)
class PlyHeader:
    """The header of a PLY.

    Attributes:
        form: ``ascii``, ``binary_little_endian`` or ``binary_big_endian``.    size: bytes of the header.
        counts: rows of each element, in the file's order.    columns: element to column name to :class:`Column`.
    """

    form: str
    size: int
    counts: dict[str, int]
    columns: dict[str, dict[str, Column]]

    @property
    def byte_order(self) -> str:
        """``<`` or ``>``, as numpy writes it."""
        return ">" if self.form == "binary_big_endian" else "<"


def read_ply_header(path: Path, data: bytes) -> PlyHeader:
    """The header of the PLY bytes `data`, its counts checked against how much data follows.

    Errors: :class:`LabError` naming `path` where the header is broken or the data are cut off.
    """
    if not data:
        raise LabError(f"{path} is empty: a PLY file was expected")
    newline = b"\r\n" if data[3:5] == b"\r\n" else b"\n"
    if not data.startswith(b"ply" + newline):
        raise LabError(f"{path} is not a PLY file: it does not begin with a line 'ply'")
    last_line = newline + b"end_header" + newline
    end = data.find(last_line, 0, _MAX_HEADER)
    if end < 0:
        raise LabError(f"{path}: its header has no end_header line: the file is broken")
    text = data[:end]
    if any(byte in text for byte in b"\0\v\f") or text.count(b"\r") != (text.count(b"\n") if newline == b"\r\n" else 0):
        raise LabError(f"{path}: its header is not plain lines of text: the file is broken")
    form, counts, columns = _declarations(path, [line.split() for line in text.split(newline)[1:]])
    if not form:
        raise LabError(f"{path}: its header has no format line: the file is broken")
    header = PlyHeader(form, end + len(last_line), counts, columns)
    there = len(data) - header.size
    # As text, a number and the space after it are two bytes at least; the last one may lack the space.
    need = sum(
        n * sum(2 if form == "ascii" else np.dtype(c.length or c.value).itemsize for c in columns[name].values())
        for name, n in counts.items()
    )
    if need > there + 1:
        raise LabError(f"{path} is cut off: its header announces {need} bytes of data or more, {there} are there")
    for name, n in counts.items():
        if n and not columns[name]:
            raise LabError(f"{path}: its element {name!r} has no properties: the file is broken")
    return header


def _declarations(path: Path, lines: list[list[bytes]]) -> tuple[str, dict[str, int], dict[str, dict[str, Column]]]:
    """Format, rows and columns of each element, as the words of the header's `lines` declare them."""
    form = ""
    counts: dict[str, int] = {}
    columns: dict[str, dict[str, Column]] = {}
    for raw in lines:
        words = [word.decode("ascii", errors="replace") for word in raw]
        line = " ".join(words)
        last = columns[list(columns)[-1]] if columns else None
        match words:
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", kind, "1.0"] if kind in _FORMATS and not form:
                form = kind
            case ["element", name, count] if count.isascii() and count.isdigit() and name not in counts:
                counts[name], columns[name] = int(count[:18]), {}
            case ["property", "list", length, value, name] if last is not None and name not in last:
                if _TYPES.get(length, "f")[0] not in "iu" or value not in _TYPES:
                    raise LabError(f"{path}: its header has the line {line[:60]!r} with an unknown type")
                last[name] = Column(_TYPES[value], _TYPES[length])
            case ["property", value, name] if last is not None and name not in last and value in _TYPES:
                last[name] = Column(_TYPES[value])
            case _:
                raise LabError(
                    f"{path}: its header has the line {line[:60]!r}, which is not PLY 1.0: the file is broken"
                )
    return form, counts, columns
