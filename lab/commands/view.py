"""``lab view``: a window to fly through the scene in, rendered by the Vulkan engine in real time."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from lab.commands.loading import load, progress
from lab.commands.render import scene_stem
from lab.commands.request import Request, read_request, whole_number
from lab.errors import LabError
from lab.outputs import check_no_input, check_writable

if TYPE_CHECKING:
    from lab.view.times import Times

MOST_FRAMES = 1_000_000


def run(args: argparse.Namespace) -> None:
    """Opens the window, and ends when it is closed."""
    args.engine = args.engine or "vulkan"
    request = read_request(args, ("vulkan",))
    frames = None if args.frames is None else whole_number("--frames", args.frames, 1, MOST_FRAMES)
    picture = _picture(args.screenshot)

    from lab.engine.vulkan.window.os_window import OsWindow
    from lab.renderer import Renderer
    from lab.view.loop import View
    from lab.view.settings import ViewSettings

    window = OsWindow(f"{scene_stem(request.scene)} - many-lights laboratory", request.size)
    try:
        with progress(request.quiet) as tell:
            scene = load(request, tell, [picture] if picture else []).scene
            tell("building the tree")
            renderer = Renderer(scene, engine="vulkan", device=request.device, threads=request.threads)
        if not request.quiet:
            for note in scene.notes:
                print(f"note: {note}")  # noqa: T201
        settings = ViewSettings(request.params, request.preset)
        view = View(window, renderer, settings, regenerate=args.regenerate, measured=frames is not None)
        try:
            view.run(frames, _next_picture(picture, request, scene.files))
            if frames is not None and picture is not None:
                view.save(picture)
            if frames is not None and not request.quiet:
                _print_times(view.times, frames, picture)
        finally:
            view.close()
            renderer.close()
    finally:
        window.close()


def _picture(text: str | None) -> Path | None:
    if text is None:
        return None
    path = Path(text)
    if path.suffix.lower() != ".png":
        raise LabError(f"--screenshot {text}: the name of the picture must end in .png")
    check_writable(path)
    return path


def _next_picture(given: Path | None, request: Request, inputs: list[Path]) -> Callable[[], Path]:
    """Names for pictures, one after the other: NAME-1.png, NAME-2.png; none that there is already."""
    base = given.with_suffix("") if given is not None else Path("out") / f"{scene_stem(request.scene)}-view"

    def name() -> Path:
        number = 1
        while (path := base.with_name(f"{base.name}-{number}.png")).exists():
            number += 1
        check_writable(path)
        check_no_input([path], inputs)
        return path

    return name


def _print_times(times: Times, frames: int, picture: Path | None) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, soft_wrap=True)
    table = Table("stage", box=None, pad_edge=False)
    table.add_column("median ms", justify="right")
    for stage, ms in times.medians().items():
        table.add_row(stage, f"{ms:,.3f}")
    console.print(f"{frames} frame{'' if frames == 1 else 's'}, stages by the device's clock")
    console.print(table)
    if picture is not None:
        console.print(f"wrote {picture}", markup=False)
