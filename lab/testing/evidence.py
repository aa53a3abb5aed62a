"""What a failing check leaves behind: pictures, an EXR and the numbers, in the folder of the running test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.errors import LabError
from lab.testing import folders
from lab.testing.pictures import Array, Pair


def leave_evidence(
    pair: Pair,
    numbers: Mapping[str, object],
    folder: str | Path | None,
    *,
    blocks: Pair | None = None,
    layers: Mapping[str, Array] | None = None,
) -> str:
    """Writes the evidence of a failure and returns a line that says where it is; never raises.

    ``images.png``: both, side by side at one exposure; ``error.png``: the signed relative error with a colour bar;
    ``evidence.exr``: layers ``image``, ``reference``, ``error`` and `layers`; ``evidence.json``: `numbers`. With
    `blocks` also ``blocks.png``, their signed error. A second failure of the same test has ``-2`` in its names.

    Args:
        pair: the pictures that were judged.
        numbers: what was measured, and what failed as `failure`; numbers (no NaN) and text.
        folder: where to write; None: the running test's folder.
        blocks: two more pictures whose difference says it better.
        layers: more (H, W) or (H, W, 3) layers of the EXR.
    """
    running = folders.current()
    if folder is None and running is None:
        return "none kept; evidence=DIR keeps pictures where no pytest plugin does"
    try:
        place = running.make() if folder is None and running else Path(folder or "")
        names = _write(place, pair, numbers, blocks, layers or {})
    except (OSError, LabError) as error:
        return f"could not be written ({error})"
    return f"{place}: {', '.join(names)}"


def _write(
    place: Path, pair: Pair, numbers: Mapping[str, object], blocks: Pair | None, layers: Mapping[str, Array]
) -> list[str]:
    from lab.error_picture import draw_error, draw_side_by_side
    from lab.image_io import Channels, write_exr, write_png
    from lab.metrics import relative_error
    from lab.outputs import Writer, write_all
    from lab.report import to_json

    text = {"failure": str(numbers["failure"])}
    pages = {
        "images.png": draw_side_by_side(pair.image, pair.reference, ("image", "reference")),
        "error.png": draw_error(pair.image, pair.reference, "signed error of the image (A) against its reference (B)"),
    }
    if blocks is not None:
        pages["blocks.png"] = draw_error(
            blocks.image, blocks.reference, "blocks that fail (A) against the reference (B)"
        )
    error = relative_error(pair.image, pair.reference)
    planes = {"image": pair.image, "reference": pair.reference, "error": error, **layers}
    channels: Channels = {
        f"{layer}.{name}": _single(values[..., i] if values.ndim == 3 else values)
        for layer, values in planes.items()
        for i, name in enumerate("RGB" if values.ndim == 3 else "Y")
    }
    written = {name: str(value) if value in (math.inf, -math.inf) else value for name, value in numbers.items()}
    writers: dict[str, Writer] = {
        **{name: partial(write_png, pixels=pixels, metadata=text) for name, pixels in pages.items()},
        "evidence.exr": partial(write_exr, channels=channels, attributes=text),
        "evidence.json": partial(_write_text, text=to_json({**written, "corner": list(pair.corner)})),
    }
    turn = 1
    while (place / _name("evidence.json", turn)).exists():
        turn += 1
    write_all({place / _name(name, turn): writer for name, writer in writers.items()})
    return [_name(name, turn) for name in writers]


def _name(name: str, turn: int) -> str:
    stem, _, ending = name.rpartition(".")
    return name if turn == 1 else f"{stem}-{turn}.{ending}"


def _single(values: Array) -> NDArray[np.float32]:
    """As float32, what is beyond its range at its end."""
    most = float(np.finfo(np.float32).max)
    return np.ascontiguousarray(np.clip(values, -most, most), np.float32)


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
