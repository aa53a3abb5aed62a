"""What the picture is compared with: other layers, other settings, another filter backend, references."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec

from gui.layers import FrameLayers
from gui.workbench import Settings, Workbench, with_preset
from lab import LabError
from lab.errors import nearest
from lab.frame import Progress
from lab.params import PRESETS
from lab.records import Frame
from lab.reference import METHODS, SETTINGS_THAT_COUNT, Reference
from lab.survey import reference_of

THIS, KEPT, KORNIA, VULKAN = "render", "kept", "kornia", "vulkan"
TITLES = {
    THIS: "this frame",
    KEPT: "the kept frame",
    **{f"preset:{name}": f"preset {name}" for name in PRESETS},
    KORNIA: "filter of kornia",
    VULKAN: "the Vulkan engine",
    "brute_force": "brute force: every light",
    "path_tracer": "path tracer",
}
"""Sources by name, as a saved state has them."""


_LIBRARIES = {KORNIA: "kornia", VULKAN: "slangpy"}


class Sources:
    """Makes what a frame is compared with, and keeps it as long as it belongs to the frame's settings.

    Attributes:
        kept: a frame set aside by hand.
    """

    def __init__(self, workbench: Workbench) -> None:
        self.workbench = workbench
        self.kept: Frame | None = None
        self._frames: dict[str, tuple[object, Frame]] = {}
        self._references: dict[str, tuple[object, Reference]] = {}
        self._layers: tuple[object, FrameLayers] | None = None

    def names(self) -> list[str]:
        """Sources that can be chosen now."""
        absent = {name for name, library in _LIBRARIES.items() if find_spec(library) is None}
        return [name for name in TITLES if name not in absent and (name != KEPT or self.kept is not None)]

    def layers(self, method: str | None = None) -> FrameLayers | None:
        """The frame's own layers, with errors against the reference of `method` (default: the best there is)."""
        frame = self.workbench.frame
        if frame is None:
            return None
        methods = ("brute_force", "path_tracer") if method is None else (method,)
        found = next(filter(None, map(self.reference, methods)), None)
        identity = id(frame), id(found)
        if self._layers is None or self._layers[0] != identity:
            self._layers = identity, FrameLayers(frame, self.workbench.renderer.engine, found)
        return self._layers[1]

    def reference(self, method: str) -> Reference | None:
        """The reference of the frame's settings, where it has been made."""
        key, found = self._references.get(method, (None, None))
        return found if found is not None and key == _reference_key(method, self.workbench.settings) else None

    def other(self, source: str) -> FrameLayers | None:
        """The layers of `source`; None where it has yet to be made.

        Errors: :class:`lab.LabError` for an unknown source, or a kept frame that is not there or of another size.
        """
        if source not in TITLES:
            raise LabError(f"there is nothing called {source!r} to compare with{nearest(source, TITLES)}")
        frame = self.workbench.frame
        if source == THIS or frame is None:
            return self.layers()
        if source in METHODS:
            return None if self.reference(source) is None else self.layers(source)
        if source == KEPT:
            if self.kept is None:
                raise LabError("no frame was kept: press 'keep' first")
            if self.kept.gbuffer.size != frame.gbuffer.size:
                raise LabError("the kept frame has another size: keep one of this size")
            return FrameLayers(self.kept)
        key, made = self._frames.get(source, (None, None))
        return None if made is None or key != _aside(source, self.workbench.settings) else FrameLayers(made)

    def maker(self, source: str) -> Callable[[Progress], Callable[[], None]]:
        """The work that makes `source` for the settings of now; what it returns puts it in its place."""
        settings = self.workbench.settings
        frame = self.workbench.frame
        if source in METHODS and frame is not None:
            return lambda progress: self._make_reference(source, settings, frame, progress)
        return lambda progress: self._make_frame(source, settings, progress)

    def _make_frame(self, source: str, settings: Settings, progress: Progress) -> Callable[[], None]:
        aside = _aside(source, settings)
        render = self.workbench.render_on_device if source == VULKAN else self.workbench.render_aside
        frame = render(aside, progress)
        return lambda: self._frames.__setitem__(source, (aside, frame))

    def _make_reference(self, method: str, settings: Settings, frame: Frame, progress: Progress) -> Callable[[], None]:
        def tell(share: float, said: str) -> None:
            progress(f"{TITLES[method]}: {100 * share:.0f} % {said}")

        with self.workbench.renderer.on_threads():
            reference = reference_of(
                self.workbench.scene, frame, method, progress=tell, engine=self.workbench.engine
            )  # fmt: skip
        key = _reference_key(method, settings)
        return lambda: self._references.__setitem__(method, (key, reference))


def _aside(source: str, settings: Settings) -> Settings:
    """The settings that `source` renders beside those of the frame."""
    if source == VULKAN:
        return settings
    if source == KORNIA:
        return replace(settings, params=settings.params.replace(filter_backend="kornia"))
    return with_preset(settings, source.removeprefix("preset:"))


def _reference_key(method: str, settings: Settings) -> object:
    values = tuple(getattr(settings.params, name) for name in SETTINGS_THAT_COUNT[method])
    return settings.camera, settings.size, values
