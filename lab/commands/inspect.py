"""``lab inspect``: see inside the hierarchy, in the browser, in a window, or as pictures of every view."""

from __future__ import annotations

import argparse
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from lab.commands.loading import progress
from lab.commands.request import Request, read_request, whole_number
from lab.errors import LabError
from lab.params import Params, parse_assignments

if TYPE_CHECKING:
    from gui.view_state import ViewState
    from gui.workbench import Workbench

SIZE = "640x360"
LAST_PORT = 65535
_NEEDED = ("pyvista", "trame", "trame_pyvista", "matplotlib", "embreex")


def run(args: argparse.Namespace) -> None:
    """Loads the scene and opens what was asked for."""
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise LabError(f"lab inspect needs {', '.join(missing)}: install it with: make setup EXTRA=gui")
    if args.window and args.screenshot is not None:
        raise LabError("--window and --screenshot exclude each other: choose one")
    port = None if args.port is None else whole_number("--port", args.port, 0, LAST_PORT)

    from gui.display import use_software_display

    if args.window:
        from gui.scene_view.window import check_display

        check_display()
    else:
        use_software_display()
    view, request = _view(args)

    from gui.workbench import Workbench

    folder = None if args.screenshot is None else _folder(args.screenshot)
    with progress(request.quiet) as tell:
        tell("loading")
        workbench = Workbench(view, request.threads)
    try:
        if args.window:
            _window(workbench, request.quiet)
        elif folder is not None:
            _screenshots(folder, workbench, view, request.quiet)
        else:
            _open(args, workbench, view, port)
    finally:
        workbench.close()


def _folder(text: str) -> Path:
    if not text:
        raise LabError("--screenshot: expected the name of a folder, for example --screenshot out/views")
    return Path(text)


def _screenshots(folder: Path, workbench: Workbench, view: ViewState, quiet: bool) -> None:
    from gui.screenshots import write_screenshots

    with progress(quiet) as tell:
        written = write_screenshots(folder, workbench, view, tell)
    if not quiet:
        print(f"wrote {len(written)} views to {folder}")  # noqa: T201


def _window(workbench: Workbench, quiet: bool) -> None:
    from gui.scene_view.window import run_window

    with progress(quiet) as tell:
        frame = workbench.render(workbench.settings, tell)
    run_window(workbench.scene, frame)


def _open(args: argparse.Namespace, workbench: Workbench, view: ViewState, port: int | None) -> None:
    from gui.inspector import Inspector
    from gui.serve import LOOPBACK, free_port, serve

    free_port(args.host or LOOPBACK, port)  # before the work of building the page
    for note in workbench.scene.notes:
        print(f"note: {note}")  # noqa: T201
    serve(Inspector(workbench, view), args.host or LOOPBACK, port)


def _view(args: argparse.Namespace) -> tuple[ViewState, Request]:
    """The state to begin with: what was saved, or the defaults, with the flags on top."""
    from gui.view_state import ViewState, read_view_state

    saved = None if args.state is None else read_view_state(Path(args.state))
    if saved is not None:
        args.scene = args.scene or saved.scene
    size = args.size or (SIZE if saved is None else "x".join(map(str, saved.size)))
    request = read_request(argparse.Namespace(**{**vars(args), "size": size}))
    params = request.params
    if saved is not None and args.preset is None:
        seed = {} if args.seed is None else {"seed": args.seed}
        params = Params().replace(**saved.params).replace(**parse_assignments(args.assignments), **seed)
    start = ViewState(scene=request.scene) if saved is None else saved
    view = replace(
        start,
        scene=request.scene,
        preset=start.preset if saved is not None and args.preset is None else request.preset,
        params=params.to_dict(),
        size=request.size,
        engine=request.engine,
        sun=start.sun if args.sun is None else args.sun,
        camera=start.camera if args.camera is None else args.camera,
    )
    return view, request
