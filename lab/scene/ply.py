"""PLY files checked to the last byte, so that open3d can read them.

On a polygon with an index out of range open3d takes the process down (segmentation fault), a face of two corners it
reads as a triangle, and to a NaN in a text file it answers with an empty mesh. trimesh reads no mix of polygons.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.scene.ply_header import PlyHeader, read_ply_header


def check_ply(path: Path) -> tuple[PlyHeader, int]:
    """The header of the PLY file at `path` and how many triangles its faces make; every vertex and face is looked at.

    Errors: :class:`LabError` for a broken header, data cut off, a coordinate that is not finite, a face of less than
    three corners or with an index out of range.
    """
    data = path.read_bytes()
    header = read_ply_header(path, data)
    body = data[header.size :]
    check = _check_text if header.form == "ascii" else _check_binary
    return header, check(path, header, body)


def _check_text(path: Path, header: PlyHeader, body: bytes) -> int:
    triangles = 0
    words = body.split()
    at = 0
    for element, count in header.counts.items():
        columns = list(header.columns[element].items())
        if any(column.length for _, column in columns):
            for row in range(count):
                for name, column in columns:
                    length = _integer(path, element, row, words, at) if column.length else 1
                    at += 1 if column.length else 0
                    values = words[at : at + max(length, 0)]
                    at += length
                    if length < 0 or at > len(words):
                        raise LabError(f"{path} is cut off or broken: {element} {row} is not whole")
                    if _is_corners(element, name):
                        try:
                            _check_face(path, header, row, np.array(values, dtype=np.int64))
                            triangles += len(values) - 2
                        except ValueError as problem:
                            if isinstance(problem, LabError):
                                raise
                            raise LabError(
                                f"{path}: {element} {row} holds something else than whole numbers"
                            ) from problem
            continue
        chunk = words[at : at + count * len(columns)]
        at += len(chunk)
        if len(chunk) < count * len(columns):
            raise LabError(f"{path} is cut off: {element} needs {count} rows of {len(columns)} numbers")
        try:
            table = np.array(chunk, dtype=np.float64).reshape(count, len(columns))
        except ValueError as problem:
            raise LabError(f"{path}: {element} holds something else than numbers: {problem}") from problem
        _check_finite(path, element, table)
    return triangles


def _check_binary(path: Path, header: PlyHeader, body: bytes) -> int:
    triangles = 0
    at = 0
    for element, count in header.counts.items():
        columns = header.columns[element]
        lists = any(column.length for column in columns.values())
        even = _even_table(header, element, body, at) if lists else None
        if not lists or even is not None:
            dtype = _row_type(header, element, {}) if even is None else even.dtype
            if at + count * dtype.itemsize > len(body):
                raise LabError(f"{path} is cut off: {element} needs {count} rows of {dtype.itemsize} bytes")
            table = np.frombuffer(body, dtype, count, at) if even is None else even
            at += count * dtype.itemsize
            for name, column in columns.items():
                if _is_corners(element, name):
                    _check_faces(path, header, table[name])
                    triangles += count * (table[name].shape[1] - 2)
                elif column.value[0] == "f" and element == "vertex":
                    _check_finite(path, element, table[name].reshape(count, -1).astype(np.float64))
            continue
        for row, name, values, end in _rows(path, header, element, body, at):
            at = end
            if _is_corners(element, name):
                _check_face(path, header, row, values)
                triangles += len(values) - 2
    return triangles


def _is_corners(element: str, name: str) -> bool:
    return element == "face" and name in ("vertex_index", "vertex_indices")


def _row_type(header: PlyHeader, element: str, lengths: dict[str, int]) -> np.dtype[Any]:
    fields: list[Any] = []
    for name, column in header.columns[element].items():
        if column.length:
            fields.append((f"length of {name}", header.byte_order + column.length))
            fields.append((name, header.byte_order + column.value, (lengths[name],)))
        else:
            fields.append((name, header.byte_order + column.value))
    return np.dtype(fields)


def _even_table(header: PlyHeader, element: str, body: bytes, at: int) -> NDArray[Any] | None:
    """The rows of `element` as one table, where each of its lists is as long in every row as in the first."""
    lengths: dict[str, int] = {}
    start = at
    for name, column in header.columns[element].items():
        if column.length:
            dtype = np.dtype(header.byte_order + column.length)
            if start + dtype.itemsize > len(body):
                return None
            lengths[name] = int(np.frombuffer(body, dtype, 1, start)[0])
            if not 0 <= lengths[name] <= len(body):
                return None
            start += dtype.itemsize + lengths[name] * np.dtype(column.value).itemsize
        else:
            start += np.dtype(column.value).itemsize
    row = _row_type(header, element, lengths)
    if at + header.counts[element] * row.itemsize > len(body):
        return None
    table = np.frombuffer(body, row, header.counts[element], at)
    return table if all((table[f"length of {name}"] == n).all() for name, n in lengths.items()) else None


def _rows(
    path: Path, header: PlyHeader, element: str, body: bytes, at: int
) -> Iterator[tuple[int, str, NDArray[Any], int]]:
    """(row, column, values, offset behind them) for every cell of `element`."""
    columns = [
        (name, np.dtype(header.byte_order + c.value), np.dtype(header.byte_order + c.length) if c.length else None)
        for name, c in header.columns[element].items()
    ]
    for row in range(header.counts[element]):
        for name, value, length in columns:
            count = 1
            if length is not None:
                if at + length.itemsize > len(body):
                    raise LabError(f"{path} is cut off: {element} {row} is not there")
                count = int(np.frombuffer(body, length, 1, at)[0])
                at += length.itemsize
            if count < 0 or at + count * value.itemsize > len(body):
                raise LabError(f"{path} is cut off or broken: {element} {row} is not whole")
            yield row, name, np.frombuffer(body, value, count, at), at + count * value.itemsize
            at += count * value.itemsize


def _integer(path: Path, element: str, row: int, words: list[bytes], at: int) -> int:
    word = words[at] if at < len(words) else b""
    if not word.isdigit() or len(word) > 9:
        raise LabError(
            f"{path}: {element} {row} should begin with a count, got {word[:20]!r}: the file is cut off or broken"
        )
    return int(word)


def _check_finite(path: Path, element: str, table: NDArray[np.float64]) -> None:
    finite = np.isfinite(table).all(axis=1)
    if not finite.all():
        raise LabError(f"{path}: {element} {int(np.argmin(finite))} holds a number that is not finite")


def _check_face(path: Path, header: PlyHeader, row: int, corners: NDArray[Any]) -> None:
    if len(corners) < 3:
        raise LabError(f"{path}: face {row} has {len(corners)} corners, 3 are needed at least")
    _check_faces(path, header, corners[None], row)


def _check_faces(path: Path, header: PlyHeader, corners: NDArray[Any], first: int = 0) -> None:
    if not corners.size:
        raise LabError(f"{path}: face {first} has no corners")
    if corners.shape[1] < 3:
        raise LabError(f"{path}: face {first} has {corners.shape[1]} corners, 3 are needed at least")
    there = header.counts.get("vertex", 0)
    if corners.dtype.kind == "f":
        raise LabError(f"{path}: its faces are not whole numbers: the file is broken")
    wrong = ((corners < 0) | (corners >= there)).any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise LabError(
            f"{path}: face {first + row} is {corners[row].tolist()}, but there are {there} vertices, 0 to {there - 1}"
        )
