"""The loop of the window: hear what a person does, render, show."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab import interrupts
from lab.colour import auto_exposure
from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.timing import Span
from lab.engine.vulkan.window.layer_values import layer_names, needs_counts
from lab.engine.vulkan.window.os_window import OsWindow
from lab.engine.vulkan.window.screen import Screen
from lab.errors import LabError
from lab.image_io import write_png
from lab.layers import COUNT, LEVEL, SCALAR, find_layer
from lab.outputs import write_all
from lab.records import Frame
from lab.renderer import Renderer
from lab.report import image_metadata
from lab.view.settings import ViewSettings
from lab.view.shown_layer import FIRST
from lab.view.times import Times
from lab.view.viewer import EVERY_FRAME, REGENERATE, Viewer

_LOOK_AGAIN_S = 0.1  # the device's clock is read no more often: the host waits for it
_REST_S = 0.005  # between two looks at a window that is minimised


class View:
    """A window that shows a scene, frame after frame.

    Attributes:
        viewer: what it shows.    times: how long that takes.    frame: the last one.

    """

    def __init__(
        self,
        window: OsWindow,
        renderer: Renderer,
        settings: ViewSettings,
        *,
        regenerate: bool = False,
        measured: bool = False,
        say: Callable[[str], None] = print,
    ) -> None:
        """`renderer`: with engine ``vulkan``. `measured`: every frame is, and none waits for the screen."""
        assert isinstance(renderer.engine, VulkanEngine)
        self._window, self._renderer, self._engine = window, renderer, renderer.engine
        self._measured, self._say = measured, say
        self.viewer = Viewer(renderer.scene, settings, self._engine.scene_radius, regenerate=regenerate)
        self.times = Times()
        self.frame: Frame | None = None
        self._counts: list[int] = []
        self._scale = self._scale_of = ""
        self._looked = 0.0
        self._counted = False
        self._untimed: deque[tuple[Mapping[str, float], Span]] = deque()
        self._screen: Screen | None = None

    def run(self, frames: int | None = None, save: Callable[[], Path] | None = None) -> None:
        """Until somebody ends it, or for so many frames. `save`: where the next picture is written."""
        last = ended = time.perf_counter()
        shown = 0
        while self._window.open and self.viewer.running and (frames is None or shown < frames):
            interrupts.check()
            inputs = self._window.poll()
            now = time.perf_counter()
            self.viewer.step(inputs, now - last)
            last = now
            if not self._step(save):
                time.sleep(_REST_S)
                continue
            now = time.perf_counter()
            if shown:  # the first one's time holds the making of shaders
                self.times.add_frame((now - ended) * 1e3)
            shown, ended = shown + 1, now
        self._read_times(0)

    def save(self, path: Path) -> None:
        """Writes the layer that is shown, without the panel."""
        if self.frame is None or self._screen is None:
            raise LabError(f"{path}: no frame was shown, so there is no picture to save")
        scene, viewer, frame = self._renderer.scene, self.viewer, self.frame
        exposure = viewer.exposure or 1.0
        pixels = self._screen.picture(frame, viewer.layer.name, exposure)
        metadata = image_metadata(scene, frame.params, frame.camera)
        metadata |= {"layer": viewer.layer.name, "exposure": f"{exposure:.9g}"}
        write_all({path: lambda beside: write_png(beside, pixels, metadata)})

    def pixels(self) -> NDArray[np.uint8]:
        """(H, W, 3) sRGB bytes of what is shown, without the panel."""
        if self.frame is None or self._screen is None:
            raise LabError("no frame was shown yet")
        return self._screen.picture(self.frame, self.viewer.layer.name, self.viewer.exposure or 1.0)

    def close(self) -> None:
        """Gives the window's surface back."""
        if self._screen is not None:
            self._screen.close()
            self._screen = None

    def _step(self, save: Callable[[], Path] | None) -> bool:
        """One frame onto the window; False where there is no place for it."""
        if 0 in self._window.size:
            return False
        frame, viewer = self._render(), self.viewer
        if viewer.exposure is None:
            viewer.exposure = _suiting(frame)
        if self._screen is None:
            state = viewer.panel_state((), (), "")
            self._screen = Screen(self._engine.gpu, self._window, viewer, state, vsync=not self._measured)
        self._do_wanted(frame, self._screen, save)
        scale = self._scale if self._scale_of == viewer.layer.name else ""
        state = viewer.panel_state(self.times.lines(), self._light_lines(), scale)
        shown = self._screen.show(frame, state, bar=max(1, len(self._counts)))
        if shown and (self._measured or time.perf_counter() - self._looked > _LOOK_AGAIN_S):
            self._look(frame, self._screen)
        return shown

    def _render(self) -> Frame:
        """The next frame; with settings that can't be rendered the last one stays, and the panel says why."""
        viewer = self.viewer
        counts = needs_counts(viewer.layer.name)
        try:
            frame = self._renderer.render(
                viewer.flight.camera,
                self._window.size,
                viewer.settings.params,
                regenerate=viewer.options[REGENERATE],
                anew=("render_gbuffer",) if viewer.options[EVERY_FRAME] else (),
                counts=counts,
            )
            if not self._counts:  # of the first frame; later ones are looked at now and then
                self._counts = _grid_lights(frame)
        except LabError as error:
            if self.frame is None:
                raise
            viewer.settings.refuse(str(error))
            if counts and not self._counted:
                viewer.layer.choose(FIRST)
            return self.frame
        viewer.settings.accept()
        self._counted = counts
        viewer.layer.offer(layer_names(frame.params, len(self._counts) - 1))
        self.frame = frame
        return frame

    def _look(self, frame: Frame, screen: Screen) -> None:
        """Reads what the panel tells of the device: times, numbers of lights, ends of the scale."""
        self._untimed.append((frame.stages_ms, self._engine.gpu.spans["present"]))
        self._read_times(1)
        try:
            self._counts = _grid_lights(frame)
        except LabError as error:  # there are more lights than it has room for, as only the device knew
            self.viewer.settings.message = str(error)
        self._scale_of = self.viewer.layer.name
        kind = find_layer(self._scale_of).kind
        low, high = screen.presenter.ends() if kind in (SCALAR, COUNT) else (0, len(self._counts) - 1)
        self._scale = f"colours from {low:.4g} to {high:.4g}" if kind in (SCALAR, COUNT, LEVEL) else ""
        self._looked = time.perf_counter()

    def _read_times(self, untimed: int) -> None:
        """Of all frames but the last `untimed`, which the device may still be at work on."""
        while len(self._untimed) > untimed:
            stages_ms, present = self._untimed.popleft()
            known = dict(stages_ms)
            done = [stage for stage, ms in known.items() if ms > 0]
            self.times.add_stages(known | {"present": present.ms}, [*done, "present"])

    def _light_lines(self) -> tuple[str, ...]:
        return tuple(f"level {level}:  {count:,}" for level, count in enumerate(self._counts))

    def _do_wanted(self, frame: Frame, screen: Screen, save: Callable[[], Path] | None) -> None:
        viewer = self.viewer
        if "fit" in viewer.wanted:
            viewer.exposure = _suiting(frame)
        if "panel" in viewer.wanted:
            screen.panel.visible = not screen.panel.visible
        if "save" in viewer.wanted and save is not None:
            path = save()
            self.save(path)
            viewer.said.append(f"wrote {path}")
        viewer.wanted.clear()
        for line in viewer.said:
            self._say(line)
        viewer.said.clear()


def _suiting(frame: Frame) -> float:
    """The exposure that suits a frame; reads it back."""
    return auto_exposure(frame.image.colour, frame.gbuffer.depth > 0)


def _grid_lights(frame: Frame) -> list[int]:
    """How many each level has; reads that back, once a hierarchy."""
    return [int(count) for count in np.diff(frame.hierarchy.offset)]
