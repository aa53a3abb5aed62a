"""What the fixtures hand out: scenes and engines that are made once a run, and calls that render with them."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lab.errors import LabError

if TYPE_CHECKING:
    from lab.engine.cpu import CpuEngine
    from lab.params import Params
    from lab.records import Frame
    from lab.reference import Reference
    from lab.scene.scene import Camera, Scene

_MOST_SCENES = 4


class Workbench:
    """Scenes by file and engines by scene, for a whole run of pytest. Only the last few are kept: some are large."""

    def __init__(self) -> None:
        self._scenes: OrderedDict[Path, Scene] = OrderedDict()
        self._engines: OrderedDict[Scene, CpuEngine] = OrderedDict()

    def scene(self, path: Path) -> Scene:
        """The scene of a file, the same object every time. Errors: as :func:`lab.load_scene`."""
        key = (path / "scene.toml" if path.is_dir() else path).resolve()
        if key not in self._scenes:
            from lab.scene.load import load_scene

            self._scenes[key] = load_scene(path)
        self._scenes.move_to_end(key)
        while len(self._scenes) > _MOST_SCENES:
            self._scenes.popitem(last=False)
        return self._scenes[key]

    def engine(self, scene: Scene) -> CpuEngine:
        """The engine of a scene, the same one every time."""
        if scene not in self._engines:
            from lab.engine.cpu import CpuEngine

            self._engines[scene] = CpuEngine(scene)
        self._engines.move_to_end(scene)
        while len(self._engines) > _MOST_SCENES:
            self._engines.popitem(last=False)
        return self._engines[scene]


def camera_of(scene: Scene, camera: str | Camera) -> Camera:
    """One of the scene's cameras by name ("": the first), a new one from ``eye:target[:up[:degrees]]``, or `camera`."""
    if not isinstance(camera, str):
        return camera
    if ":" in camera and all(camera != known.name for known in scene.cameras):
        from lab.scene.override import parse_camera

        return parse_camera(camera)
    return scene.camera(camera)


def _params(params: Params | None, settings: dict[str, object]) -> Params:
    from lab.params import Params as Plain

    return (params or Plain()).replace(**settings)


def _named(fixture: str, scene: Scene, size: tuple[int, int]) -> str:
    """A line for the report of a failing test, in which a whole scene would take pages."""
    return f"<{fixture} of {scene.name}, {size[0]}x{size[1]}>"


@dataclass(frozen=True, repr=False)
class Renderer:
    """What ``lab_render`` is: renders the test's scene, with the test's camera and size where a call names no other."""

    scene: Scene
    engine: CpuEngine
    camera: Camera
    size: tuple[int, int]

    def __repr__(self) -> str:
        return _named("lab_render", self.scene, self.size)

    def __call__(
        self,
        params: Params | None = None,
        /,
        *,
        camera: str | Camera | None = None,
        size: tuple[int, int] | None = None,
        **settings: object,
    ) -> Frame:
        """One frame. ``lab_render(alpha=2)`` changes single settings of `params`, or of the defaults.

        Errors: :class:`lab.LabError` for unknown settings, values out of range and unknown cameras.
        """
        __tracebackhide__ = True
        from lab.library import render

        try:
            return render(
                self.scene,
                _params(params, settings),
                camera=self.camera if camera is None else camera_of(self.scene, camera),
                size=size or self.size,
                engine=self.engine,
            )
        except LabError as error:
            # Raised anew: a wrong setting is shown at the line of the test that has it, not in here.
            raise error.with_traceback(None) from None


@dataclass(frozen=True, repr=False)
class Referee:
    """What ``lab_reference`` is: references of the test's scene, kept on disk from run to run."""

    scene: Scene
    engine: CpuEngine
    camera: Camera
    size: tuple[int, int]

    def __repr__(self) -> str:
        return _named("lab_reference", self.scene, self.size)

    def __call__(
        self,
        method: str,
        params: Params | None = None,
        /,
        *,
        spp: int | None = None,
        error: float | None = None,
        seconds: float | None = None,
        pixel: str = "centre",
        camera: str | Camera | None = None,
        size: tuple[int, int] | None = None,
        **settings: object,
    ) -> Reference:
        """The reference by `method`, ``"brute_force"`` or ``"path_tracer"``.

        Brute force sums every virtual point light of `params` with every shadow ray: give it the settings of the frame
        that is judged (``frame.params``). `spp`, `error` and `seconds` bound the work, whichever is met first; see
        :func:`lab.reference.render_reference`, which never hands out a reference of another scene or other settings.
        """
        __tracebackhide__ = True
        from lab.reference import Budget, render_reference

        try:
            return render_reference(
                self.scene,
                method,
                _params(params, settings),
                camera=self.camera if camera is None else camera_of(self.scene, camera),
                size=size or self.size,
                budget=Budget(spp=spp, error=error, seconds=seconds),
                pixel=pixel,
                engine=self.engine,
            )
        except LabError as problem:
            raise problem.with_traceback(None) from None
