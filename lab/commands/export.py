"""``lab export``: the lights and every level of the hierarchy, for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

from lab.commands.loading import load, progress
from lab.commands.request import read_request
from lab.errors import LabError
from lab.outputs import check_writable, is_folder


def run(args: argparse.Namespace) -> None:
    """Traces the lights, builds the hierarchy and writes it."""
    request = read_request(args)
    path = Path(args.output)
    if is_folder(path):
        raise LabError(f"-o {path}: is a folder; name a file in it, for example -o {path / 'lights.npz'}")

    from lab.engine import create_engine
    from lab.export import export_format, export_hierarchy
    from lab.report import export_metadata

    export_format(path)
    check_writable(path)
    with progress(request.quiet) as tell:
        loaded = load(request, tell, [path])
        engine = create_engine(request.engine, loaded.scene)
        tell("trace_vpls")
        lights = engine.trace_vpls(request.params)
        tell("build_hierarchy")
        hierarchy = engine.build_hierarchy(lights, request.params)
        tell("writing")
        files = export_hierarchy(path, hierarchy, export_metadata(loaded.scene, request.params))
    if not request.quiet:
        counts = ", ".join(f"L{level.level} {len(level):,}" for level in hierarchy.levels)
        print(f"{loaded.scene.name}: {counts} lights")  # noqa: T201
        for note in loaded.scene.notes:
            print(f"note: {note}")  # noqa: T201
        print(f"wrote {files[0]}" + (f" and {len(files) - 1} files beside it" if len(files) > 1 else ""))  # noqa: T201
