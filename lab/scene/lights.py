"""The user's own lists of point lights: ``.npz``, ``.csv`` and ``.ply`` point clouds, checked column by column.

A light has a position, a radiant intensity (linear RGB) and optionally a normal. Without a normal, or with the normal
(0, 0, 0), it is isotropic and its flux is 4 pi I; with one it is a one-sided Lambertian emitter of intensity I along
the normal, and its flux is pi I. Normals of any length but 0 are brought to length 1.

- ``.npz``: arrays ``position`` (n, 3), ``intensity`` (n, 3) and optionally ``normal`` (n, 3);
- ``.csv``: a header line ``x,y,z,r,g,b`` or ``x,y,z,r,g,b,nx,ny,nz`` (any order), one light a line;
- ``.ply``: vertex columns ``x y z red green blue`` and optionally ``nx ny nz``; whole-number colours count from 0 to 1.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError, nearest
from lab.records import Lights
from lab.scene.ply import check_ply
from lab.scene.quiet import native_quiet, quiet

_NORMAL_CSV = ("nx", "ny", "nz")
_CSV = ("x", "y", "z", "r", "g", "b")
_PLY = ("x", "y", "z", "red", "green", "blue")


def load_light_list(path: str | Path) -> Lights:
    """The lights in the file at `path`, see the module's page for the three formats.

    Errors: :class:`LabError` for a file that is missing, broken or empty, for missing and unknown columns, and (with
    the number of the light, from 0) for a value that is not finite or an intensity under 0.
    """
    path = Path(path)
    readers = {".npz": _read_npz, ".csv": _read_csv, ".ply": _read_ply}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise LabError(f"{path}: a light list ends in {', '.join(readers)}, not in {path.suffix or 'nothing'!r}")
    if not path.is_file():
        raise LabError(f"{path}: there is no such file" if not path.exists() else f"{path} is not a file")
    if path.stat().st_size == 0:
        raise LabError(f"{path} is empty: a list of lights was expected")
    try:
        position, intensity, normal = reader(path)
    except OSError as problem:
        raise LabError(f"{path} cannot be read: {problem}") from problem
    return _checked(path, position, intensity, normal)


def save_light_list(path: str | Path, lights: Lights) -> None:
    """Writes `lights` as an ``.npz`` list that :func:`load_light_list` reads back (written beside, then renamed)."""
    path = Path(path)
    if path.suffix.lower() != ".npz":
        raise LabError(f"{path}: light lists are written as .npz, name the file {path.stem}.npz")
    normal = np.zeros_like(lights.position) if lights.normal is None else lights.normal
    arrays = {"position": lights.position, "intensity": (lights.flux / _flux_per_intensity(normal)).astype(np.float32)}
    if normal.any():
        arrays["normal"] = normal
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with beside.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
        beside.replace(path)
    except OSError as problem:
        beside.unlink(missing_ok=True)
        raise LabError(f"{path} cannot be written: {problem}") from problem


def _flux_per_intensity(normal: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.where((normal != 0).any(axis=1, keepdims=True), np.pi, 4 * np.pi)


Columns = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None]


def _checked(path: Path, position: NDArray[Any], intensity: NDArray[Any], normal: NDArray[Any] | None) -> Lights:
    if len(position) == 0:
        raise LabError(f"{path} holds no lights: it has no rows")
    for name, values in (("position", position), ("intensity", intensity), ("normal", normal)):
        if values is None:
            continue
        wrong = ~(np.isfinite(values) & (np.abs(values) <= np.finfo(np.float32).max)).all(axis=1)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise LabError(f"{path}: light {row} has {name} {values[row].tolist()}: every number must be finite")
    negative = (intensity < 0).any(axis=1)
    if negative.any():
        row = int(np.argmax(negative))
        raise LabError(f"{path}: light {row} has intensity {intensity[row].tolist()}: it must be 0 or more")
    unit = np.zeros_like(position) if normal is None else _unit(normal)
    flux = intensity * _flux_per_intensity(unit)
    if not (flux <= np.finfo(np.float32).max).all():
        row = int(np.argmax((flux > np.finfo(np.float32).max).any(axis=1)))
        raise LabError(f"{path}: light {row} has intensity {intensity[row].tolist()}, which is too large")
    return Lights(
        position.astype(np.float32), flux.astype(np.float32), None if normal is None else unit.astype(np.float32)
    )


def _unit(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    largest = np.abs(normal).max(axis=1, keepdims=True)
    scaled = normal / np.where(largest > 0, largest, 1)  # so that no square vanishes or overflows
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    return scaled / np.where(length > 0, length, 1)


def _check_names(
    path: Path, found: Iterable[str], needed: tuple[str, ...], optional: tuple[str, ...], kind: str
) -> bool:
    """True if the optional columns are there too; :class:`LabError` for missing or unknown ones."""
    names = list(found)
    form = f"{' '.join(needed)}, optionally {' '.join(optional)}"
    for name in needed:
        if name not in names:
            raise LabError(
                f"{path}: the {kind} {name!r} is missing; needed are {form}; it has {' '.join(names) or 'none'}"
            )
    for name in names:
        if name not in (*needed, *optional):
            raise LabError(f"{path}: unknown {kind} {name!r}{nearest(name, (*needed, *optional))}; allowed are {form}")
        if names.count(name) > 1:
            raise LabError(f"{path}: the {kind} {name!r} is there twice")
    there = [name for name in optional if name in names]
    if there and len(there) < len(optional):
        raise LabError(f"{path}: of {' '.join(optional)} only {' '.join(there)} is there: give all or none")
    return bool(there)


def _read_npz(path: Path) -> Columns:
    data = path.read_bytes()
    if data[:2] != b"PK":
        raise LabError(f"{path} is not an .npz file: write it with numpy.savez(file, position=..., intensity=...)")
    with quiet():
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
        except Exception as problem:  # zipfile, zlib and numpy raise each their own
            raise LabError(
                f"{path} cannot be read as .npz: {problem}; the file is broken or holds objects"
            ) from problem
    _check_names(path, arrays, ("position", "intensity"), ("normal",), "array")
    for name, array in arrays.items():
        if array.dtype.kind not in "fiu":
            raise LabError(f"{path}: array {name!r} holds {array.dtype}, numbers were expected")
        if array.ndim != 2 or array.shape[1] != 3:
            raise LabError(f"{path}: array {name!r} has shape {array.shape}, expected (n, 3)")
        if len(array) != len(arrays["position"]):
            raise LabError(
                f"{path}: {len(arrays['position'])} positions but {len(array)} rows in {name!r}: they must agree"
            )
    wide = {name: array.astype(np.float64) for name, array in arrays.items()}
    return wide["position"], wide["intensity"], wide.get("normal")


def _read_csv(path: Path) -> Columns:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as problem:
        raise LabError(f"{path} is not text (byte {problem.start}): a .csv list of lights was expected") from problem
    rows = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not rows:
        raise LabError(f"{path} is empty: it must begin with the line {','.join(_CSV)}")
    names = [name.strip().strip('"').lower() for name in rows[0][1].split(",")]
    has_normal = _check_names(path, names, _CSV, _NORMAL_CSV, "column")
    table = np.empty((len(rows) - 1, len(names)))
    for k, (number, line) in enumerate(rows[1:]):
        values = line.split(",")
        if len(values) != len(names):
            raise LabError(f"{path}, line {number}: {len(values)} values for {len(names)} columns ({','.join(names)})")
        try:
            table[k] = [float(value) for value in values]
        except ValueError as problem:
            raise LabError(f"{path}, line {number}: {problem}") from problem
    pick = [table[:, [names.index(name) for name in group]] for group in (_CSV[:3], _CSV[3:])]
    return pick[0], pick[1], table[:, [names.index(name) for name in _NORMAL_CSV]] if has_normal else None


def _read_ply(path: Path) -> Columns:
    header, _ = check_ply(path)
    if not header.counts.get("vertex"):
        raise LabError(f"{path} holds no lights: it has no vertices")
    if header.counts.get("face"):
        raise LabError(f"{path} is a mesh with {header.counts['face']} faces: a list of lights has vertices alone")
    columns = header.columns["vertex"]
    has_normal = _check_names(path, columns, _PLY, _NORMAL_CSV, "column")
    kinds = {columns[name].value for name in _PLY[3:]}
    if any(column.length for column in columns.values()) or len(kinds) > 1:
        raise LabError(f"{path}: its columns must be single numbers, and red, green and blue of one type")
    import open3d

    with native_quiet(), open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        try:
            cloud = open3d.io.read_point_cloud(path)
        except Exception as problem:  # whatever the library stumbles on, the file is at fault
            raise LabError(f"{path} cannot be read as PLY: {problem}") from problem
    position, colour = np.asarray(cloud.points), np.asarray(cloud.colors)
    if len(position) != header.counts["vertex"] or len(colour) != len(position):
        raise LabError(
            f"{path}: only {len(position)} of {header.counts['vertex']} lights could be read: the file is broken"
        )
    kind = kinds.pop()
    # open3d divides every colour by 255, whatever its type.
    intensity = colour * 255.0 if kind[0] == "f" else colour * (255.0 / np.iinfo(kind).max)
    return position, intensity, np.asarray(cloud.normals) if has_normal else None
