"""What the inspector works on: a scene, its settings with their history, and the frames rendered of it. No widgets."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gui.view_state import ViewState
from lab import LabError, Params, Renderer, load_scene
from lab.engine.cpu import CpuEngine
from lab.frame import Progress
from lab.params import PRESETS, preset
from lab.records import Frame
from lab.scene.override import override, parse_camera
from lab.scene.scene import Camera, Scene

MOST_STEPS = 200


@dataclass(frozen=True)
class Settings:
    """What a frame is rendered with: one step of the history."""

    preset: str
    params: Params
    camera: str
    size: tuple[int, int]


class Workbench:
    """One scene, an engine that keeps what it can, and the settings with undo.

    Attributes:
        scene: with the view state's sun.    renderer: of the frame shown.    aside: of frames it is compared with, so
            that these don't cost the first one its kept stages.
        settings: those of the next frame.    frame: the last one rendered, None before the first.
    """

    def __init__(self, view: ViewState, threads: int | None = None) -> None:
        """Loads the scene and builds the ray tracer's tree. Errors: :class:`lab.LabError` for bad files and values."""
        self.scene: Scene = override(load_scene(view.scene), sun=view.sun or None)
        self.renderer = Renderer(self.scene, engine=view.engine, threads=threads)
        self.aside = Renderer(self.scene, engine=view.engine, threads=threads)
        self.settings = settings_of(view)
        self.camera_of(view.camera)
        self.frame: Frame | None = None
        self._on_device: Renderer | None = None
        self._past: list[Settings] = []
        self._future: list[Settings] = []

    @property
    def engine(self) -> CpuEngine:
        """The engine of the frame shown, for what only the CPU's can do: probes and references."""
        engine = self.renderer.engine
        if not isinstance(engine, CpuEngine):
            raise LabError("pixels are probed by the engine cpu alone: start with --engine cpu")
        return engine

    def camera_of(self, text: str) -> Camera:
        """The scene's camera of that name ("": the first), or the one that eye:target[:up[:fov]] describes."""
        if ":" in text and all(text != camera.name for camera in self.scene.cameras):
            return parse_camera(text)
        return self.scene.camera(text)

    def render(self, settings: Settings, progress: Progress) -> Frame:
        """The frame of `settings`; only the stages that have changed are done. `progress` may raise to end it."""
        camera = self.camera_of(settings.camera)
        return self.renderer.render(camera, settings.size, settings.params, counts=True, progress=progress)

    def render_aside(self, settings: Settings, progress: Progress) -> Frame:
        """Another frame, to compare with."""
        camera = self.camera_of(settings.camera)
        return self.aside.render(camera, settings.size, settings.params, counts=True, progress=progress)

    def render_on_device(self, settings: Settings, progress: Progress) -> Frame:
        """The same frame by the Vulkan engine, read back. Errors: :class:`lab.LabError` where there is no device."""
        if self._on_device is None:
            progress("preparing the device")
            self._on_device = Renderer(self.scene, engine="vulkan")
        camera = self.camera_of(settings.camera)
        frame = self._on_device.render(camera, settings.size, settings.params, counts=True, progress=progress)
        progress("reading back")
        names = ("image", "lights", "hierarchy", "gbuffer", "lighting", "shadows", "filtered")
        return replace(frame, **{name: replace(getattr(frame, name)) for name in names})

    def change(self, **changes: object) -> Settings:
        """New settings, one step forward; they stay as they were where a value is refused.

        Args:
            changes: ``camera``, ``size``, or any setting of :class:`lab.Params` by name.
        """
        view = {name: changes.pop(name) for name in ("camera", "size") if name in changes}
        params = self.settings.params.replace(**changes)
        if "camera" in view:
            self.camera_of(str(view["camera"]))
        return self._step(replace(self.settings, params=params, **view))  # type: ignore[arg-type]

    def choose_preset(self, name: str) -> Settings:
        """All settings as the preset says; the seed and the number of VPLs stay."""
        return self._step(with_preset(self.settings, name))

    def reset(self) -> Settings:
        """All settings as the preset says."""
        return self._step(replace(self.settings, params=preset(self.settings.preset)))

    def take(self, settings: Settings) -> Settings:
        """Settings from elsewhere, one step forward."""
        return self._step(settings)

    def undo(self) -> Settings:
        """One step back, where there is one."""
        return self._travel(self._past, self._future)

    def redo(self) -> Settings:
        """One step forward again."""
        return self._travel(self._future, self._past)

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps can be undone, and redone."""
        return len(self._past), len(self._future)

    def changed_settings(self) -> dict[str, object]:
        """What differs from the preset, by name."""
        base = Params().replace(**PRESETS[self.settings.preset]).to_dict()
        return {name: value for name, value in self.settings.params.to_dict().items() if value != base[name]}

    def close(self) -> None:
        """Gives the kept memory back."""
        self.renderer.close()
        self.aside.close()
        if self._on_device is not None:
            self._on_device.close()

    def _step(self, settings: Settings) -> Settings:
        if settings != self.settings:
            self._past.append(self.settings)
            del self._past[:-MOST_STEPS]
            self._future.clear()
            self.settings = settings
        return settings

    def _travel(self, from_: list[Settings], to: list[Settings]) -> Settings:
        if from_:
            to.append(self.settings)
            self.settings = from_.pop()
        return self.settings


def with_preset(settings: Settings, name: str) -> Settings:
    """`settings` as the preset says; the lights and the random numbers stay."""
    kept = {key: getattr(settings.params, key) for key in ("vpls", "max_bounces", "seed", "frame")}
    return replace(settings, preset=name, params=preset(name, **kept))


def settings_of(view: ViewState) -> Settings:
    """What a view state renders."""
    return Settings(view.preset, Params().replace(**view.params), view.camera, view.size)


def command_line(scene: str, settings: Settings, changed: dict[str, object], sun: str = "") -> str:
    """The ``lab render`` that makes this frame in a shell."""
    import shlex

    words = ["lab", "render", scene, "--size", "x".join(map(str, settings.size))]
    words += ["--preset", settings.preset] if settings.preset != "ours" else []
    words += ["--camera", settings.camera] if settings.camera else []
    words += ["--sun", sun] if sun else []
    words += ["--set", *(f"{name}={_word(value)}" for name, value in changed.items())] if changed else []
    return shlex.join(words)


def python_code(scene: str, settings: Settings, changed: dict[str, object], sun: str = "") -> str:
    """The Python that makes this frame."""
    lines = ["import lab", "", f"scene = lab.load_scene({scene!r})"]
    if sun:
        lines[1:2] = ["from lab.scene.load import override", ""]
        lines.append(f"scene = override(scene, sun={sun!r})")
    arguments = "".join(f", {name}={value!r}" for name, value in changed.items())
    lines.append(f"params = lab.preset({settings.preset!r}{arguments})")
    camera = repr(settings.camera)
    if ":" in settings.camera:
        lines[1:1] = ["from lab.scene.override import parse_camera"]
        camera = f"parse_camera({settings.camera!r})"
    lines.append(f"frame = lab.render(scene, params, camera={camera}, size={settings.size})")
    return "\n".join(lines) + "\n"


def _word(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
