"""A visit to the window, as a person would pay it; run under Xvfb, in a process of its own.

    python -m tests.unit.window_visit FOLDER SCENE     writes FOLDER/visit.json and pictures

The X server writes its screen to FOLDER/Xvfb_screen0 (``-fbdir FOLDER``), so that what is really seen can be compared.
"""

from __future__ import annotations

import json
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

import lab
from lab.cli import main
from lab.colour import to_bytes
from lab.engine.vulkan.buffers import BufferPool
from lab.engine.vulkan.window.os_window import OsWindow
from lab.errors import LabError
from lab.params import Params
from lab.renderer import Renderer
from lab.scene.scene import Camera
from lab.view.loop import View
from lab.view.settings import ViewSettings

from ..oracle_geometry.scenes import lamp_room

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (160, 90)
PARAMS = Params(vpls=200, shadow_samples=1, direct_samples=1)
Pixels = NDArray[np.uint8]


def read_screen(path: Path) -> Pixels:
    """(H, W, 3): the screen as the X server keeps it (an XWD file, 32 bits a pixel, little-endian BGRX)."""
    data = path.read_bytes()
    header = struct.unpack(">25I", data[:100])
    header_size, width, height, stride, colours = header[0], header[4], header[5], header[12], header[19]
    rows = np.frombuffer(data, np.uint8, stride * height, header_size + 12 * colours).reshape(height, stride)
    return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1]


class Visit:
    """The window and what is found out."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.found: dict[str, Any] = {}
        self.said: list[str] = []
        self.scene = replace(lamp_room(), cameras=[CAMERA])
        self.renderer = Renderer(self.scene, engine="vulkan")
        self.window = OsWindow("visit", SIZE)
        self.window.raw.on_mouse_event = None  # the screen's own mouse stays out of this
        settings = ViewSettings(PARAMS, "ours")
        self.view = View(self.window, self.renderer, settings, measured=True, say=self.said.append)
        self.viewer = self.view.viewer

    def press(self, key: str, mods: Any = spy.KeyModifierFlags.none, release: bool = True) -> None:
        """A key goes down, and up again."""
        event = spy.KeyboardEvent()
        event.type, event.key, event.mods = spy.KeyboardEventType.key_press, getattr(spy.KeyCode, key), mods
        self.window.on_key(event)
        if release:
            event.type = spy.KeyboardEventType.key_release
            self.window.on_key(event)

    def mouse(self, kind: str, x: float, y: float, scroll: float = 0.0) -> None:
        """The mouse does something at a place of the window."""
        event = spy.MouseEvent()
        event.type, event.pos = getattr(spy.MouseEventType, kind), spy.float2(x, y)
        event.scroll, event.button = spy.float2(0, scroll), spy.MouseButton.left
        self.window.on_mouse(event)

    def frames(self, count: int = 1) -> None:
        self.view.run(count, lambda: self.folder / "saved.png")

    def seen(self, wanted: Pixels) -> tuple[Pixels, int]:
        """The window's part of the screen, and how far it is from `wanted`; X has its time to show it."""
        for _ in range(40):
            part = read_screen(self.folder / "Xvfb_screen0")[: SIZE[1], : SIZE[0]]
            difference = int(np.abs(part.astype(int) - wanted).max())
            if difference <= 1:
                break
            time.sleep(0.05)
        return part, difference

    def read_back(self, run: Callable[[], None]) -> int:
        """How often buffers came to the host meanwhile."""
        download, count = BufferPool.download, [0]

        def counted(pool: BufferPool, *arguments: Any) -> Any:
            count[0] += 1
            return download(pool, *arguments)

        BufferPool.download = counted  # type: ignore[method-assign]
        try:
            run()
        finally:
            BufferPool.download = download  # type: ignore[method-assign]
        return count[0]

    def panel(self) -> Any:
        assert self.view._screen is not None
        return self.view._screen.panel

    def run(self) -> None:
        found, viewer = self.found, self.viewer
        self.frames(2)
        frame = lab.render(self.scene, PARAMS, size=SIZE, engine=self.renderer.engine)
        picture = to_bytes(frame.image.colour, viewer.exposure or 0)
        found["colours"] = len(np.unique(picture.reshape(-1, 3), axis=0))
        found["picture"] = int(np.abs(self.view.pixels().astype(int) - picture).max())
        found["with_panel"] = self.seen(picture)[1]
        self.press("tab")
        self.frames(2)
        found["without_panel"] = self.seen(picture)[1]
        found["medians"] = list(self.view.times.medians())

        eye = np.array(viewer.flight.camera.eye)
        self.press("w", release=False)
        found["read_back"] = self.read_back(lambda: self.frames(3))
        self.press("w")
        found["moved"] = float(np.linalg.norm(np.array(viewer.flight.camera.eye) - eye))
        self.mouse("button_down", 80, 40)
        self.mouse("move", 90, 44)
        before = self.view.pixels().astype(int)
        self.frames()
        found["looked"] = float(np.abs(self.view.pixels() - before).mean())
        self.mouse("button_up", 90, 44)
        speed = viewer.flight.speed
        self.mouse("scroll", 90, 44, 1.0)
        self.frames()
        found["faster"] = viewer.flight.speed / speed
        self.press("r")
        self.frames()
        found["back"] = int(np.abs(self.view.pixels().astype(int) - picture).max())

        self.press("down")
        self.press("key2")
        self.frames()
        found["layer"] = viewer.layer.name
        viewer.choose_layer("overdraw")
        self.frames()
        counted = lab.render(self.scene, PARAMS, size=SIZE, engine=self.renderer.engine).lighting.overdraw
        assert counted is not None and self.view._screen is not None
        found["overdraw"] = [self.view._screen.presenter.ends()[1], int(counted.sum(axis=0).max())]
        viewer.choose_layer("colour")

        self.window.raw.resize(120, 64)
        self.frames(3)
        found["resized"] = list(self.view.pixels().shape)
        self.window.raw.resize(*SIZE)
        self.frames(3)

        self.settings()
        self.press("f12")
        self.press("p")
        self.press("escape")
        self.frames(5)
        found["running"] = viewer.running
        found["said"] = self.said

    def settings(self) -> None:
        """Through the panel's own widgets."""
        found, viewer, panel = self.found, self.viewer, self.panel()
        panel.visible = True
        widgets = panel._settings
        widgets["alpha"].widget._get_callback()(0.1 + 1e-9)
        widgets["filter"].widget._get_callback()(list(widgets["filter"].control.items).index("none"))
        widgets["sigma_normal"]._switch._get_callback()(True)
        self.frames(2)
        assert self.view.frame is not None
        got = self.view.frame.params
        found["settings"] = [got.alpha, got.filter, got.sigma_normal]
        found["shown"] = [widgets["alpha"].widget.label, round(widgets["alpha"].widget.value, 6)]
        widgets["alpha"].widget._get_callback()(-1.0)
        self.frames(2)
        found["refused"] = [panel._message.visible, panel._message.text, self.view.frame.params.alpha]
        render = self.renderer.render

        def fail(*_: Any, **__: Any) -> None:
            self.renderer.render = render  # type: ignore[method-assign]
            raise LabError("no frame can have these")

        widgets["alpha"].widget._get_callback()(5.0)
        self.renderer.render = fail  # type: ignore[assignment, method-assign]
        self.frames(2)
        found["failed"] = [panel._message.text, self.view.frame.params.alpha]
        panel._preset._get_callback()(1)
        self.frames()
        found["preset"] = [viewer.settings.preset, self.view.frame.params.lobe]
        widgets["seed"].widget._get_callback()("7")
        panel._heading._get_callback()(1)
        self.frames()
        found["typed"] = [self.view.frame.params.seed, viewer.layer.name]

    def close(self) -> None:
        self.view.close()
        self.renderer.close()
        self.window.close()


def visit_command(folder: Path, scene: str, found: dict[str, Any]) -> None:
    """``lab view`` beside ``lab render``."""
    flags = ["--size", f"{SIZE[0]}x{SIZE[1]}", "--set", "vpls=200", "shadow_samples=1", "direct_samples=1"]
    picture = folder / "command.png"
    found["code"] = main(["view", scene, *flags, "--frames", "2", "--screenshot", str(picture)])
    found["render"] = main(["render", scene, *flags, "--engine", "vulkan", "-o", str(folder / "render"), "--quiet"])


if __name__ == "__main__":
    where = Path(sys.argv[1])
    visit = Visit(where)
    visit.run()
    visit.close()
    visit_command(where, sys.argv[2], visit.found)
    (where / "visit.json").write_text(json.dumps(visit.found, indent=2))
