"""``lab export``: the lights and every level of the hierarchy, or the scene itself, for other programs."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from lab.commands.loading import load, progress
from lab.commands.request import Request, read_request
from lab.errors import LabError
from lab.outputs import check_writable, is_folder


def run(args: argparse.Namespace) -> None:
    """Writes what the ending of the output asks for."""
    request = read_request(args)
    path = Path(args.output)
    if is_folder(path):
        raise LabError(f"-o {path}: is a folder; name a file in it, for example -o {path / 'lights.npz'}")

    from lab.export import SCENE_FORMAT, export_format

    wanted = export_format(path)
    check_writable(path)
    if wanted == SCENE_FORMAT:
        _export_scene(request, path)
        return
    for flag in ("camera", "size"):
        if getattr(args, flag) is not None:
            raise LabError(f"--{flag} counts only for {SCENE_FORMAT}: {wanted} holds the lights, which no camera sees")
    _export_hierarchy(request, path)


def _export_hierarchy(request: Request, path: Path) -> None:
    from lab.engine import create_engine
    from lab.export import export_hierarchy
    from lab.report import export_metadata

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
        _say(f"{loaded.scene.name}: {counts} lights", loaded.scene.notes, files)


def _export_scene(request: Request, path: Path) -> None:
    from lab.mitsuba_scene import export_mitsuba

    with progress(request.quiet) as tell:
        scene = load(request, tell, [path]).scene
        tell("writing")
        written = export_mitsuba(path, scene, scene.camera(), request.size, request.params)
    if not request.quiet:
        width, height = request.size
        what = f"{scene.name}: {scene.triangles:,} triangles, camera {scene.camera().name}, {width}x{height}"
        _say(what, [*scene.notes, *written.notes], written.files)


def _say(what: str, notes: Iterable[str], files: list[Path]) -> None:
    print(what)  # noqa: T201
    for note in notes:
        print(f"note: {note}")  # noqa: T201
    print(f"wrote {files[0]}" + (f" and {len(files) - 1} files beside it" if len(files) > 1 else ""))  # noqa: T201
