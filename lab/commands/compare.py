"""``lab compare``: one layer of two EXR files, the numbers as JSON on stdout and pictures of the difference."""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.commands.render import write_text
from lab.comparison import Layer, Record, measure, read_layers, read_region
from lab.errors import LabError
from lab.outputs import Writer, check_no_input, check_writable, write_all

PICTURES = ("side_by_side.png", "error.png", "flip.png")
JSON = "comparison.json"


def run(args: argparse.Namespace) -> None:
    """Compares, writes the pictures if there is a folder for them, and prints the JSON."""
    from lab.report import to_json

    regions = [read_region(text) for text in args.region]
    folder = None if args.output is None else _folder(args.output, [args.a, args.b])
    a, b = read_layers(args.a, args.b, args.layer)
    record = measure(a, b, regions, args.per_channel)
    error_map = record.pop("flip_map")
    if folder is not None:
        _write(folder, a, b, record, error_map)
    sys.stdout.write(to_json(record))


def _folder(output: str, inputs: list[str]) -> Path:
    """The folder of the pictures, checked: all can be written, and none is one of the images compared."""
    folder = Path(output)
    if not output:
        raise LabError("-o: expected the name of a folder, for example -o out/comparison")
    paths = [folder / name for name in (*PICTURES, JSON)]
    for path in paths:
        check_writable(path)
    check_no_input(
        paths, [Path(image) for image in inputs], "one of the images to compare; choose another folder with -o"
    )
    return folder


def _write(folder: Path, a: Layer, b: Layer, record: Record, error_map: NDArray[np.float32] | None) -> None:
    """Writes pictures and JSON, all or none; adds their paths to the record."""
    from lab import __version__
    from lab.error_picture import draw_error, draw_flip, draw_side_by_side
    from lab.image_io import write_png
    from lab.report import machine, to_json

    names = f"A: {a.file}", f"B: {b.file}"
    layer = a.name or "R G B"
    value = record["rel_mse"]
    measured = "" if value is None else f", relMSE {value:.4g}"
    pages = {
        "side_by_side.png": draw_side_by_side(a.pixels, b.pixels, names),
        "error.png": draw_error(a.pixels, b.pixels, f"relative error of A against B, {layer}{measured}"),
    }
    if error_map is not None:
        settings = record["flip_settings"]
        said = f"mean {record['flip']:.4g}, {settings['pixels_per_degree']:.1f} pixels a degree"
        pages["flip.png"] = draw_flip(error_map, f"HDR-FLIP of A against B, {layer}", said)
    record["files"] = [str(folder / name) for name in (*pages, JSON)]
    metadata = {"lab_version": __version__, "a": a.file, "b": b.file, "layer": a.name, "machine": json.dumps(machine())}
    text = to_json(record)

    writers: dict[Path, Writer] = {
        folder / name: partial(write_png, pixels=pixels, metadata=metadata) for name, pixels in pages.items()
    }
    write_all(writers | {folder / JSON: partial(write_text, text=text)})
