"""``lab render``: a scene to BASE.png, BASE.exr and BASE.json."""

from __future__ import annotations

import argparse
from pathlib import Path

from lab.commands.loading import load, progress, render
from lab.commands.request import Request, read_request
from lab.commands.summary import print_summary
from lab.engine.engine import ENGINES
from lab.outputs import base_path, beside, check_writable, write_all

ENDINGS = (".png", ".exr", ".json")


def run(args: argparse.Namespace) -> None:
    """Renders and writes the three files, all or none."""
    request = read_request(args, ENGINES)
    base = output_base(args.output, request)

    from lab.colour import to_bytes
    from lab.image_io import frame_channels, write_exr, write_png
    from lab.report import image_metadata, run_record, to_json

    paths = [beside(base, ending) for ending in ENDINGS]
    with progress(request.quiet) as tell:
        loaded = load(request, tell, paths)
        frame = render(loaded, request.params, request, tell)
        tell("writing")
        scene = loaded.scene
        metadata = image_metadata(scene, frame.params, frame.camera)
        record = run_record(frame, scene, loaded.run, base)
        text = to_json(record)
        pixels = to_bytes(frame.image.colour, record["scene"]["exposure"])
        png, exr, json_file = paths
        write_all(
            {
                png: lambda path: write_png(path, pixels, metadata),
                exr: lambda path: write_exr(path, frame_channels(frame), metadata),
                json_file: lambda path: write_text(path, text),
            }
        )
    if not request.quiet:
        print_summary(record, paths)


def output_base(output: str | None, request: Request, suffix: str = "") -> Path:
    """Where the files go, checked: as given, or beside the repeated record, or out/SCENE."""
    if output is not None:
        base = base_path(output)
    elif request.record is not None:
        record = Path(request.record)
        base = record.with_name(f"{record.stem}-again")
    else:
        base = Path("out") / f"{scene_stem(request.scene)}{suffix}"
    for ending in ENDINGS:
        check_writable(beside(base, ending))
    return base


def scene_stem(scene: str) -> str:
    """The name of a scene's files: its own, or its folder's where the file is just called scene.toml."""
    path = Path(scene)
    if path.name.lower() == "scene.toml":
        path = path.resolve().parent
    return (path.name if path.is_dir() else path.stem) or "scene"


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8."""
    path.write_text(text, encoding="utf-8")
