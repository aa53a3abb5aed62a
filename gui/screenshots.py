"""Every view as a PNG under a fixed name, without a browser: for documents and scripts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from gui.layers import FrameLayers, draw_layer, layer_picture, png_bytes
from gui.legend import draw_legend
from gui.plots import (
    blend_plot,
    distribution_plot,
    growth_plot,
    level_shares_plot,
    levels_plot,
    overdraw_levels_plot,
    picks_plot,
    timings_plot,
    to_png,
)
from gui.plots.shadows import MAPS
from gui.scene_view import SceneView
from gui.view_state import ViewState
from gui.wipe import wipe
from gui.workbench import Workbench
from lab.figure import PAPER
from lab.frame import Progress
from lab.outputs import check_writable, write_all
from lab.pixel import Probe, member_shares, probe_pixel, sample_pixel
from lab.records import Frame
from lab.report import level_records, shown_exposure
from lab.survey import compare_importance, leak_map, overdraw_growth, overdraw_survey, reference_of

LAYERS = (
    "colour", "direct", "indirect", "unshadowed", "shadow_ratio_noisy", "shadow_ratio", "albedo", "normal", "depth",
    "overdraw", "lights_used", "picked_level.0", "pick_surprise",
)  # fmt: skip
_SCENE_PX, _PLOT_PX, _DRAWS, _PICKS = (1280, 800), (960, 560), 4096, 16

Pixels = NDArray[np.uint8]
Views = Iterator[tuple[str, Callable[[], bytes]]]


def write_screenshots(folder: Path, workbench: Workbench, view: ViewState, progress: Progress) -> list[Path]:
    """Renders the frame of `view` and every view of it into ``folder/NAME.png``; all files or none.

    ``layer-NAME`` each layer with its legend; ``wipe`` colour against the other layer of `view`; ``scene``,
    ``scene-levels``, ``scene-light``, ``scene-pixel`` the 3D view; ``pixel-blend``, ``pixel-picks`` the probe;
    ``overdraw``, ``overdraw-growth``, ``shadows-levels``, ``shadows-...``, ``importance-...``, ``leaks``, ``levels``,
    ``timings`` the panels. Where `view` selects no pixel or light, one of the foreground and its strongest grid
    light are taken.

    Errors: :class:`lab.LabError` where the folder can't be written.
    """
    check_writable(folder / "layer-colour.png")
    progress("rendering")
    workbench.frame = workbench.render(workbench.settings, progress)
    shots = _Shots(workbench, view, workbench.frame)
    made: dict[Path, bytes] = {}
    try:
        for name, draw in shots.views(progress):
            progress(name)
            made[folder / f"{name}.png"] = draw()
    finally:
        shots.close()
    write_all({path: partial(_write, data=data) for path, data in made.items()})
    return list(made)


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)


class _Shots:
    """The views of one frame; what several of them need is made once."""

    def __init__(self, workbench: Workbench, view: ViewState, frame: Frame) -> None:
        self.workbench, self.view, self.frame = workbench, view, frame
        self.layers = FrameLayers(frame, workbench.renderer.engine)
        self.exposure = shown_exposure(workbench.scene, frame) * 2.0**view.exposure

    def views(self, progress: Progress) -> Views:
        """Names and what draws them, in the order of the frame."""
        frame = self.frame
        for name in LAYERS:
            if name in self.layers.names:
                yield f"layer-{name}", partial(self._layer, name)
        for level in range(frame.params.first_level, frame.hierarchy.top + 1):
            yield f"layer-overdraw.L{level}", partial(self._layer, f"overdraw.L{level}")
        yield "wipe", self._wipe
        for name in ("scene", "scene-levels", "scene-light", "scene-pixel"):
            yield name, partial(self._scene, name)
        if self.probe.depth > 0:
            yield "pixel-blend", lambda: self._plot(blend_plot(frame.params, frame.hierarchy, self.probe))
            if frame.params.shadow_samples:
                yield "pixel-picks", self._picks
        yield "overdraw", lambda: self._plot(overdraw_levels_plot(overdraw_survey(frame)))
        if self.workbench.scene.light_list is None:
            yield "overdraw-growth", partial(self._growth, progress)
        if frame.params.shadow_samples:
            yield from self._shadows(progress)
        yield "leaks", partial(self._leaks, progress)
        yield (
            "levels",
            lambda: self._plot(levels_plot(level_records(frame.hierarchy, frame.lighting, frame.gbuffer.depth > 0))),
        )
        yield "timings", lambda: self._plot(timings_plot(frame.stages_ms))

    def close(self) -> None:
        """Frees the 3D view."""
        if "scene" in self.__dict__:
            self.scene.close()

    @cached_property
    def scene(self) -> SceneView:
        """The 3D view."""
        return SceneView(self.workbench.scene, window_size=_SCENE_PX)

    @cached_property
    def probe(self) -> Probe:
        """Of the selected pixel, or of the first that sees a surface on the way up from the foot of the picture."""
        frame, pixel = self.frame, self.view.pixel
        if pixel is None:
            width, height = frame.gbuffer.size
            rows = [y for y in range(int(0.75 * height), -1, -1) if frame.gbuffer.depth[y, width // 2] > 0]
            pixel = width // 2, rows[0] if rows else height // 2
        return probe_pixel(self.workbench.engine, frame, *pixel)

    @property
    def light(self) -> int | None:
        """The selected light, or the one that lights the pixel most."""
        if self.view.light is not None and self.view.light < len(self.frame.hierarchy.position):
            return self.view.light
        lights = self.probe.lights
        return int(lights.sorted().index[0]) if len(lights) else None

    def _layer(self, name: str) -> bytes:
        shown = layer_picture(self.layers, name, exposure=self.exposure, log=self.view.log_scale)
        return png_bytes(_above(shown.pixels, draw_legend(shown.legend, max(320, shown.pixels.shape[1]))))

    def _wipe(self) -> bytes:
        """Of the layers that `view` compares; only this frame's, which need no other render."""
        names = self.view.layer, self.view.other_layer
        names = tuple(name if name in self.layers.names else "colour" for name in names)  # type: ignore[assignment]
        a, b = (layer_picture(self.layers, name, exposure=self.exposure) for name in names)
        return png_bytes(wipe(a.pixels, b.pixels, self.view.wipe, (a.layer.title, b.layer.title)))

    def _scene(self, name: str) -> bytes:
        scene, frame, view = self.scene, self.frame, self.view
        hierarchy, probe = frame.hierarchy, self.probe
        levels = {level for level in view.levels if level <= hierarchy.top}
        light = self.light if name == "scene-light" else None
        scene.show_mesh(view.mesh, view.opacity if name != "scene-light" else 0.35)
        scene.show_vpls(frame.lights if view.vpls or name == "scene" else None)
        shown = {"scene-levels": levels or {1}, "scene-light": set[int](), "scene-pixel": set[int]()}.get(name)
        scene.show_levels(hierarchy if shown else None, shown or (), view.colour_by)
        scene.show_cells(hierarchy, view.cells if name == "scene-levels" and 0 < view.cells <= hierarchy.top else None)
        members = None if light is None else member_shares(hierarchy, light, frame.params)
        scene.select_light(hierarchy, light, frame.params, members)
        scene.show_probe(probe if name == "scene-pixel" else None)
        scene.look_from(frame.camera)
        if light is not None:
            scene.fly_to(hierarchy.position[light])
        return png_bytes(scene.screenshot())

    def _picks(self) -> bytes:
        probe = self.probe
        trials = sample_pixel(self.workbench.engine, self.frame, probe.x, probe.y, _DRAWS, seed=self.frame.params.seed)
        return self._plot(picks_plot(trials))

    def _growth(self, progress: Progress) -> bytes:
        growth = overdraw_growth(
            self.workbench.engine, self.frame.gbuffer, progress=lambda share, said: progress(f"overdraw-growth: {said}")
        )
        return self._plot(growth_plot(growth))

    def _shadows(self, progress: Progress) -> Views:
        found = compare_importance(
            self.workbench.engine, self.frame, _PICKS, lambda share, said: progress(f"shadows: {said}")
        )
        sides = {"by importance": found.on.distribution, "evenly": found.off.distribution}
        yield "shadows-levels", lambda: self._plot(level_shares_plot(sides))
        for name in MAPS:
            yield (
                f"shadows-{name.replace('_', '-')}",
                partial(lambda name: self._plot(distribution_plot(sides, name)), name),
            )
        for name, image in (
            ("importance-on-before", found.on.unfiltered), ("importance-off-before", found.off.unfiltered),
            ("importance-on-after", found.on.frame.image), ("importance-off-after", found.off.frame.image),
        ):  # fmt: skip
            yield name, partial(self._light, image.colour)

    def _light(self, colour: NDArray[np.float32]) -> bytes:
        return png_bytes(draw_layer(colour, "light", exposure=self.exposure))

    def _leaks(self, progress: Progress) -> bytes:
        reference = reference_of(
            self.workbench.scene, self.frame, "brute_force", engine=self.workbench.engine,
            progress=lambda share, said: progress(f"leaks: {100 * share:.0f} % {said}"),
        )  # fmt: skip
        found = leak_map(self.frame, reference)
        layers = FrameLayers(self.frame, self.workbench.renderer.engine, reference)
        shown = layer_picture(layers, "error.indirect", low=-1.0, high=1.0)
        pixels = draw_layer(found.smoothed(4), "signed", low=-1.0, high=1.0, seen=found.seen)
        return png_bytes(_above(pixels, draw_legend(shown.legend, max(320, pixels.shape[1]))))

    @staticmethod
    def _plot(figure: object) -> bytes:
        return to_png(figure, *_PLOT_PX)  # type: ignore[arg-type]


def _above(picture: Pixels, legend: Pixels) -> Pixels:
    """The picture over its legend, on one page."""
    width = max(picture.shape[1], legend.shape[1])
    page = Image.new("RGB", (width, picture.shape[0] + legend.shape[0]), PAPER)
    page.paste(Image.fromarray(picture), (0, 0))
    page.paste(Image.fromarray(np.ascontiguousarray(legend)), (0, picture.shape[0]))
    return np.asarray(page)
