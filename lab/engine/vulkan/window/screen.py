"""What stands on the window: the picture of a layer, and the panel over it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.window.os_window import OsWindow
from lab.engine.vulkan.window.panel import Panel
from lab.engine.vulkan.window.panel_state import PanelActions, PanelState
from lab.engine.vulkan.window.present import Presenter
from lab.records import Frame

if TYPE_CHECKING:
    from lab.engine.vulkan.device import Gpu


class Screen:
    """The surface of a window. Pictures go to it on the device alone.

    Attributes:
        panel: over the picture.    presenter: makes the pictures.

    """

    def __init__(self, gpu: Gpu, window: OsWindow, actions: PanelActions, state: PanelState, *, vsync: bool) -> None:
        """`vsync`: no more pictures than the screen shows."""
        spy = import_slangpy()
        self._gpu, self._window, self._vsync = gpu, window, vsync
        self._surface = gpu.device.create_surface(window.raw)
        # Linear pictures are encoded as they come onto the surface, if it does that; else before.
        formats = [self._surface.info.preferred_format, *self._surface.info.formats]
        self._format = next((kind for kind in formats if "srgb" in kind.name), formats[0])
        self._encode = "srgb" not in self._format.name
        self._size = (0, 0)
        self._ui = spy.ui.Context(gpu.device)
        window.panel = self._ui
        self.presenter = Presenter(gpu)
        self.panel = Panel(self._ui.screen, actions, window.size, state)

    def show(self, frame: Frame, state: PanelState, *, bar: int) -> bool:
        """Puts a layer of `frame` and the panel onto the window; False where there was no place for it just now.

        `bar`: see :meth:`~lab.engine.vulkan.window.present.Presenter.record`.
        """
        size = self._window.size
        if 0 in size:
            return False
        if size != self._size:
            self._surface.configure(*size, format=self._format, vsync=self._vsync)
            self._size = size
        image = self._surface.acquire_next_image()
        if image is None:
            self._size = (0, 0)  # it was lost, or has another size now
            return False
        self.panel.show(state)
        self._ui.begin_frame(*size, self._window.raw)
        with self._gpu.stage("present") as encoder:
            picture = self.presenter.record(encoder, frame, state.layer, state.exposure, bar=bar, encode=self._encode)
            encoder.blit(image, picture)
            self._ui.end_frame(image, encoder)
        del image
        self._surface.present()
        return True

    def picture(self, frame: Frame, layer: str, exposure: float) -> NDArray[np.uint8]:
        """(H, W, 3) sRGB bytes of a layer as the window shows it, without panel and colour bar."""
        return self.presenter.pixels(frame, layer, exposure)

    def close(self) -> None:
        """Gives the surface back, once the device is done with it."""
        self._gpu.device.wait()
        self._window.panel = None
        self._surface.unconfigure()
