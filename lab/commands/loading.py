"""From a checked request to a loaded scene and a frame, with the progress people see meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from lab import interrupts
from lab.commands.request import Request, exposure_of
from lab.outputs import check_no_input
from lab.params import Params
from lab.records import Frame
from lab.report import RunInfo
from lab.scene.scene import Scene

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Loaded:
    """A scene with the request's overrides, and what its run is called in the record."""

    scene: Scene
    run: RunInfo


@contextmanager
def progress(quiet: bool) -> Iterator[Progress]:
    """A line that tells the stage at work and the time since the start; nothing unless a person watches stderr."""
    from rich.console import Console

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda stage: interrupts.check()
        return
    from rich.progress import Progress as Bar
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def tell(stage: str) -> None:
            interrupts.check()
            bar.update(task, description=stage)

        yield tell


def load(request: Request, tell: Progress, outputs: Iterable[Path]) -> Loaded:
    """Reads the scene and applies the overrides; sets the core's threads first, since loading may use them.

    Stops where one of `outputs` is a file that the scene was read from.
    """
    from lab.scene.load import load_scene, override

    if request.threads is not None:
        from lab import _core

        _core.set_threads(request.threads)
    device = None
    if request.engine == "vulkan":
        from lab.engine.vulkan.device import open_gpu

        tell("opening the device")
        device = open_gpu(request.device).describe()
    tell("loading")
    start = time.perf_counter()
    scene = load_scene(request.scene)
    check_no_input(outputs, scene.files)
    scene = override(
        scene,
        camera=request.overrides.get("camera"),
        sun=request.overrides.get("sun"),
        exposure=exposure_of(request),
    )
    load_ms = (time.perf_counter() - start) * 1e3
    return Loaded(scene, RunInfo(request.preset, request.engine, load_ms, request.overrides, device))


def render(loaded: Loaded, params: Params, request: Request, tell: Progress) -> Frame:
    """One frame of the loaded scene from its first camera (the one `override` put there)."""
    import lab

    return lab.render(
        loaded.scene, params, size=request.size, engine=request.engine, device=request.device, progress=tell
    )
