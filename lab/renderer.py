"""Frame after frame of one scene: what costs time once is done once."""

from __future__ import annotations

import dataclasses
import threading
import weakref
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from types import TracebackType

from lab import _core
from lab.engine.clock import StageTimes
from lab.engine.dependencies import outdated_by
from lab.engine.engine import STAGES, create_engine
from lab.engine.kept import KeptStages, Made
from lab.errors import LabError
from lab.frame import Progress
from lab.library import render
from lab.params import Params
from lab.records import Frame
from lab.scene.scene import Camera, Scene


class Cancelled(Exception):  # noqa: N818 (nothing went wrong)
    """For a `progress` that wants no more of a frame to raise: the render ends with it, and the next one is right."""


class Renderer:
    """Renders a scene again and again, from any camera and with any settings.

        with lab.Renderer(scene) as renderer:
            for camera in path:
                frame = renderer.render(camera, (1280, 720), lab.Params(shadow_samples=1))

    It keeps the ray tracer's tree, and the memory of the last frames for the next. It also keeps the last result of
    every stage, and takes it again where nothing that it depends on has changed (:mod:`lab.engine.dependencies`):
    another camera needs no new lights, another filter no new rays. ``regenerate=True`` does all seven stages anew, as
    for a scene that moves.

    A Vulkan engine keeps its device, shaders and scene as well, and the results where they are, on the device.

    Frames are the same, bit for bit, as those of :func:`lab.render`. They may share arrays with each other: treat
    what is in them as read-only. They stay valid after :meth:`close`.

    Any thread may render, one at a time: others wait. Python goes on in the other threads while a stage is at work.
    """

    def __init__(self, scene: Scene, *, engine: str = "cpu", device: str = "", threads: int | None = None) -> None:
        """Builds the ray tracer's tree.

        Args:
            scene: from :func:`lab.load_scene`, or made in Python.
            engine: an engine's name.
            device: for engine ``vulkan``, which Vulkan device, by name or number; empty for the first.
            threads: threads of this renderer's frames, whichever thread asks for them; default: as many as the one
                that makes the renderer uses. Results don't depend on it.
        """
        if threads is not None and (int(threads) != threads or threads < 1):
            raise LabError(f"threads: expected a whole number, at least 1, got {threads}")
        self.scene = scene
        self.threads = int(_core.info()["threads"]) if threads is None else int(threads)
        with self.on_threads():
            self.engine = create_engine(engine, scene, device=device)
        self._stages: type[KeptStages] = KeptStages
        if engine == "vulkan":
            from lab.engine.vulkan.kept import KeptOnDevice

            self._stages = KeptOnDevice
        self._kept: dict[str, Made] = {}
        self._turn = threading.RLock()
        _core.keep_buffers()
        self._release = weakref.finalize(self, _core.release_buffers)

    def render(
        self,
        camera: str | Camera = "",
        size: tuple[int, int] = (1280, 720),
        params: Params | None = None,
        *,
        regenerate: bool = False,
        anew: Collection[str] = (),
        counts: bool = False,
        progress: Progress | None = None,
    ) -> Frame:
        """One frame; arguments as of :func:`lab.render`, but that lights are counted only if asked.

        With `regenerate` every stage is done anew; with `anew` these stages are, and all that depend on them. Else a
        stage whose result was taken again has 0 ms in ``frame.stages_ms``. `progress` may raise :class:`Cancelled`, or
        anything else, to break the frame off before the stage that it is told of; what the stages before made is kept.
        """
        with self._turn, self.on_threads():
            if not self._release.alive:
                raise LabError("Renderer: it is closed; make another to render again")
            for stage in STAGES if regenerate else outdated_by(*anew):
                self._kept.pop(stage, None)
            stages = self._stages(self.engine, self._kept)
            frame = render(
                self.scene, params, camera=camera, size=size, engine=stages, progress=progress, counts=counts
            )
            times = frame.stages_ms  # alone: whoever holds them must not hold the frame
            return dataclasses.replace(frame, stages_ms=StageTimes(lambda: times).only(stages.ran))

    def close(self) -> None:
        """Gives the kept memory back to the system. Frames that are still held stay as they are."""
        with self._turn:
            self._kept.clear()
            self._release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @contextmanager
    def on_threads(self) -> Iterator[None]:
        """While this lasts, what the calling thread asks of the core is done by this renderer's number of threads.

        The number is each thread's own: a worker that calls ``engine`` itself would get the core's default.
        """
        before = int(_core.info()["threads"])
        _core.set_threads(self.threads)
        try:
            yield
        finally:
            _core.set_threads(before)
