"""Records of a pixel as plain JSON values, rows and CSV."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.colour import luminance
from lab.errors import LabError
from lab.outputs import check_writable, write_all
from lab.params import Params
from lab.pixel.records import ProbedLights

ENDINGS = (".json", ".csv")


def light_columns(lights: ProbedLights) -> dict[str, NDArray[Any]]:
    """The columns of the light table, by name."""
    columns = {field.name: getattr(lights, field.name) for field in dataclasses.fields(lights)}
    columns["luminance"] = luminance(lights.contribution)
    columns["cumulative_share"] = lights.cumulative_share
    order = (
        "index level distance blend_weight receiver_cosine emission falloff scale contribution luminance share "
        "cumulative_share target_weight probability position flux"
    )
    return {name: columns[name] for name in order.split()}


def plain(value: Any) -> Any:
    """`value` as JSON knows it: arrays are lists, records are objects, what is not finite is None."""
    if isinstance(value, Params):
        return value.to_dict()
    if dataclasses.is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        if value.dtype == np.float32:  # its own digits, not those of the double nearest to it
            value = np.array([float(str(number)) for number in value.ravel()]).reshape(value.shape)
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def rows_of(columns: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Columns of one length as one object a row."""
    values = {name: plain(column) for name, column in columns.items()}
    return [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]


def csv_of(columns: Mapping[str, NDArray[Any]]) -> str:
    """Columns as CSV; of three numbers a column becomes three, ``flux_r`` or ``position_x`` and so on."""
    heads: list[str] = []
    parts: list[list[Any]] = []
    for name, column in columns.items():
        axes = "xyz" if name in ("position", "point") else "rgb"
        heads += [name] if column.ndim == 1 else [f"{name}_{axis}" for axis in axes]
        parts += [plain(column)] if column.ndim == 1 else plain(column.T)
    lines = [",".join("" if value is None else str(value) for value in row) for row in zip(*parts, strict=True)]
    return "\n".join([",".join(heads), *lines]) + "\n"


def check_ending(path: str | Path) -> Path:
    """`path`, which must end in ``.json`` or ``.csv`` and be writable, or a :class:`LabError`."""
    target = Path(path)
    if target.suffix.lower() not in ENDINGS:
        raise LabError(f"{path}: expected a name that ends in .json (everything) or .csv (the table of lights)")
    check_writable(target)
    return target


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8, whole or not at all."""

    def write(target: Path) -> None:
        target.write_text(text, encoding="utf-8")

    write_all({path: write})
