"""The inspector: one scene, one state, shown in the browser. What a click does, from top to bottom."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from trame.app import get_server

from gui.downloads import exported_bytes
from gui.jobs import Job, Jobs, Progress, message_of
from gui.layout import build_page
from gui.panels.all import make_panels
from gui.panels.panel import Panel
from gui.panels.params import ParamsPanel
from gui.panels.pixel import PixelPanel
from gui.sources import Sources
from gui.view_state import ViewState, parse_view_state
from gui.workbench import Settings, Workbench, command_line, python_code, settings_of
from lab import LabError
from lab.pixel import Probe, probe_pixel
from lab.records import Frame
from lab.report import export_metadata, shown_exposure

T = TypeVar("T")

LATER_SECONDS = 0.02
TELL_SECONDS = 0.25

log = logging.getLogger("lab.inspect")


class Inspector:
    """The page and everything behind it. Every browser that opens it sees the same inspector.

    Attributes:
        workbench: scene, settings, frames.    sources: what they are compared with.
        view: what is shown of them; the truth that is saved.    state: the page's variables.
        panels: by name; those in the lower row are shown one at a time.
    """

    def __init__(self, workbench: Workbench, view: ViewState, name: str = "inspector") -> None:
        self.workbench, self.view = workbench, view
        self.server = get_server(name, client_type="vue3")
        self.state, self.ctrl = self.server.state, self.server.controller
        self.sources = Sources(workbench)
        self.jobs = Jobs(self._job_changed, self._job_failed)
        self.panels: dict[str, Panel] = {}
        self._exposed: tuple[Frame, float] | None = None
        self._probe: tuple[Frame, tuple[int, int], Probe] | None = None
        self._later: dict[str, Callable[[], None]] = {}
        self._closed = False
        self._told = 0.0
        self.params = ParamsPanel(self)
        self._set_up_state()
        self.panels = make_panels(self)
        build_page(self)
        self.ctrl.on_server_ready.add(lambda **_: self.settings_changed())
        self.ctrl.on_server_exited.add(lambda **_: self.close())

    # --- frames -----------------------------------------------------------------------------------

    @property
    def frame(self) -> Frame | None:
        """The frame that is shown."""
        return self.workbench.frame

    def settings_changed(self) -> None:
        """Renders what the settings now ask for; a frame that is still being made is given up."""
        self.params.show()
        settings = self.workbench.settings
        self.view = replace(
            self.view, preset=settings.preset, params=settings.params.to_dict(), camera=settings.camera,
            size=settings.size,
        )  # fmt: skip

        def render(progress: Progress) -> Frame:
            return self.workbench.render(settings, progress)

        self.run("render", render, self._rendered)

    def choose_preset(self, name: str) -> None:
        """All settings as the preset says."""
        self._apply(lambda: self.workbench.choose_preset(name))

    def choose_camera(self, text: str) -> None:
        """Looks through another camera: its name, or eye:target[:up[:fov]]."""
        self._apply(lambda: self.workbench.change(camera=text))

    def reset(self) -> None:
        """All settings back to the preset."""
        self._apply(self.workbench.reset)

    def undo(self) -> None:
        """One change of the settings back."""
        self._apply(self.workbench.undo)

    def redo(self) -> None:
        """One change of the settings forward again."""
        self._apply(self.workbench.redo)

    # --- what is selected and shown ---------------------------------------------------------------

    @property
    def pixel(self) -> tuple[int, int] | None:
        """The pixel that is probed, where the picture has it."""
        pixel = self.view.pixel
        width, height = self.workbench.settings.size
        return pixel if pixel is not None and pixel[0] < width and pixel[1] < height else None

    @property
    def light(self) -> int | None:
        """Merged index of the selected grid light, where the hierarchy has it."""
        light, frame = self.view.light, self.frame
        return light if light is not None and frame is not None and light < len(frame.hierarchy.position) else None

    @property
    def probe(self) -> Probe | None:
        """What the selected pixel is, where there is one."""
        frame, pixel = self.frame, self.pixel
        if frame is None or pixel is None or frame.gbuffer.size[0] <= pixel[0] or frame.gbuffer.size[1] <= pixel[1]:
            return None
        if self._probe is None or self._probe[0] is not frame or self._probe[1] != pixel:
            self._probe = frame, pixel, probe_pixel(self.workbench.engine, frame, *pixel)
        return self._probe[2]

    def select_pixel(self, pixel: tuple[int, int] | None) -> None:
        """Probes a pixel (x, y); None: none."""
        self.look(pixel=pixel)

    def select_light(self, index: int | None) -> None:
        """Selects a grid light by its merged index; None: none."""
        self.look(light=index)

    def look(self, **changes: Any) -> None:
        """Changes what is shown, not what is rendered: fields of :class:`ViewState`."""
        before = self.view.panel
        try:
            self.view = replace(self.view, **changes)
        except LabError as error:
            self.say(str(error))
            return
        if self.view.panel != before and before in self.panels:
            self.panels[before].hide()
        self.refresh()

    def ask_for_account(self) -> None:
        """Has the selected pixel say which lights answer for its error."""
        panel = self.panels["pixel"]
        if isinstance(panel, PixelPanel):
            panel.blame()

    @property
    def exposure(self) -> float:
        """Factor on light before it is shown: the scene's, or what suits the frame, with the user's stops."""
        frame = self.frame
        if frame is not None and (self._exposed is None or self._exposed[0] is not frame):
            self._exposed = frame, shown_exposure(self.workbench.scene, frame)
        return (1.0 if self._exposed is None else self._exposed[1]) * math.exp2(self.view.exposure)

    # --- work and words -----------------------------------------------------------------------------

    def run(self, name: str, work: Callable[[Progress], T], done: Callable[[T], None]) -> None:
        """Runs `work` beside the page, and `done` with its result on the page; a newer job of that name replaces it."""

        def finish(result: T) -> None:
            with self.state:
                done(result)

        self.jobs.submit(name, work, finish)

    def later(self, name: str, draw: Callable[[], None]) -> None:
        """Draws what takes long once the page has been sent the rest; of one name only the last."""
        waiting = name in self._later
        self._later[name] = draw
        if not waiting:
            asyncio.get_running_loop().call_later(LATER_SECONDS, self._draw_later, name)

    def say(self, text: str, colour: str = "error") -> None:
        """Shows a message at the foot of the page."""
        with self.state:
            self.state.message, self.state.message_colour, self.state.message_open = text, colour, True

    # --- saving -------------------------------------------------------------------------------------

    def saved(self) -> str:
        """The whole state as the text of a file."""
        return self.view.to_json()

    def restore(self, text: str, source: str = "the file") -> None:
        """Goes back to a saved state; what is damaged, or of another scene, changes nothing."""
        try:
            view = parse_view_state(text, source)
            if view.scene != self.view.scene:
                raise LabError(
                    f"{source}: was saved of {view.scene}; this inspector shows {self.view.scene}. Start: "
                    f"lab inspect {view.scene} --state FILE"
                )
            self.workbench.camera_of(view.camera)
        except LabError as error:
            self.say(str(error))
            return
        self.view = view
        self.workbench.take(settings_of(view))
        self.settings_changed()

    def command(self) -> str:
        """The settings as a command line."""
        return command_line(self.view.scene, self.workbench.settings, self.workbench.changed_settings(), self.view.sun)

    def python(self) -> str:
        """The settings as Python."""
        return python_code(self.view.scene, self.workbench.settings, self.workbench.changed_settings(), self.view.sun)

    def exported(self, ending: str) -> bytes:
        """The levels as a file of another program; several files come as one .zip."""
        if self.frame is None:
            return b""
        metadata = export_metadata(self.workbench.scene, self.frame.params)
        return exported_bytes(self.frame.hierarchy, f"{self.workbench.scene.name}{ending}", metadata)

    def screenshot(self, name: str) -> bytes:
        """A view as it is shown, as PNG: ``picture``, ``scene``, or the ``panel`` that is open."""
        panel = self.panels.get(self.view.panel if name == "panel" else name)
        return b"" if panel is None else panel.screenshot()

    def close(self) -> None:
        """Ends all work and frees what it held."""
        self._closed = True
        self.jobs.close()
        for panel in self.panels.values():
            panel.close()
        self.workbench.close()

    # --- inside ---------------------------------------------------------------------------------------

    def _apply(self, step: Callable[[], Settings]) -> None:
        before = self.workbench.settings
        try:
            step()
        except LabError as error:
            self.say(str(error))
            return
        if self.workbench.settings != before:
            self.settings_changed()

    def _rendered(self, frame: Frame) -> None:
        self.workbench.frame = frame
        self.refresh()

    def refresh(self) -> None:
        """Brings the open panels up to date; what fails is told, and the others still show."""
        with self.state:
            for name in ("picture", "scene", self.view.panel):
                if name in self.panels:
                    self._guarded(name, self.panels[name].show)
            self.state.panel, self.state.split = self.view.panel, self.view.split
            self.state.command_text, self.state.python_text = self.command(), self.python()

    def _draw_later(self, name: str) -> None:
        draw = self._later.pop(name)
        if not self._closed:
            with self.state:
                self._guarded(name, draw)

    def _guarded(self, name: str, draw: Callable[[], None]) -> None:
        """Draws; what fails is told, and the rest of the page still shows."""
        try:
            draw()
        except Exception as error:  # a broken panel must not take the page with it
            log.exception("panel %s", name)
            self.say(f"{name}: {message_of(error)}")

    def _set_up_state(self) -> None:
        self.state.trame__title = f"{self.workbench.scene.name} - many-lights laboratory"
        self.state.scene_name, self.state.scene_notes = self.workbench.scene.name, list(self.workbench.scene.notes)
        self.state.message, self.state.message_colour, self.state.message_open = "", "error", False
        self.state.busy, self.state.undo_steps, self.state.redo_steps = "", 0, 0
        self.state.panel, self.state.split = self.view.panel, self.view.split
        self.state.command_text, self.state.python_text = "", ""

    def _job_changed(self, job: Job | None) -> None:
        # Every word makes the browser look through the whole page: stages of a few milliseconds are not told.
        now = time.monotonic()
        if job is not None and self.state.busy and now - self._told < TELL_SECONDS:
            return
        self._told = now
        with self.state:
            self.state.busy = "" if job is None else (job.stage or job.name)

    def _job_failed(self, name: str, error: BaseException) -> None:
        if not isinstance(error, LabError):
            log.error("job %s", name, exc_info=error)
        self.say(f"{name}: {message_of(error)}")
