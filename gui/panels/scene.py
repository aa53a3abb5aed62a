"""The scene in 3D: triangles, lights, levels and cells, the selected light taken apart, the rays of the pixel."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable
from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3
from trame.widgets.vtk import VtkRemoteView

from gui.layers import png_bytes
from gui.panels.panel import DENSE, Panel
from gui.scene_view import SceneView
from gui.scene_view.navigation import Navigation
from gui.view_state import COLOUR_BYS, MESH_STYLES
from lab import LabError
from lab.pixel import member_shares, pixel_of_point
from lab.scene.scene import Camera

ENCODING_SECONDS = (0.03, 0.08, 0.2)


class ScenePanel(Panel):
    """A view rendered here and streamed; the browser sends the mouse."""

    _view: SceneView | None = None
    _widget: Any = None
    _changed = False
    _looked: tuple[float, ...] = ()

    def build(self) -> None:
        """Choices above, the view below."""
        view = SceneView(self.app.workbench.scene)
        self._view, self._drawn = view, dict[str, Hashable]()
        state = self.state
        state.level_items, state.shown_levels, state.top_level, state.scene_note = [], [], 1, ""
        state.cell_items, state.slider_level = [], 1
        self._navigation = Navigation(view, lambda: self.app.later("settle", self._settle), self._click)
        with html.Div(classes="lab-picture-panel"):
            self._choices()
            with html.Div(classes="lab-picture-place", id="scene"):
                self._widget = VtkRemoteView(
                    view.plotter.render_window, interactive_ratio=1, still_ratio=1, interactive_quality=70,
                    still_quality=92,
                )  # fmt: skip
            html.Div("{{ scene_note }}", v_if=("scene_note",), classes="lab-scene-note", id="scene-note")

    @property
    def view(self) -> SceneView:
        """The 3D view."""
        if self._view is None:
            raise LabError("the scene view is closed")
        return self._view

    # --- what is shown ----------------------------------------------------------------------------

    def show(self) -> None:
        """Redraws what has changed since the last time, each part on its own."""
        app, view, state = self.app, self.app.view, self.state
        state.mesh, state.opacity, state.colour_by = view.mesh, view.opacity, view.colour_by
        state.vpls_shown, state.legend_shown = view.vpls, view.legend
        self._part("mesh", (view.mesh, view.opacity), lambda: self.view.show_mesh(view.mesh, view.opacity))
        self._part("legend", view.legend, lambda: self.view.show_legend(view.legend))
        camera = app.workbench.camera_of(app.workbench.settings.camera)
        size = app.workbench.settings.size
        self._part("frustum", (camera, size), lambda: self.view.show_frustum(camera, size))
        self._part("eye", view.scene_camera or camera, self._look)
        if app.frame is not None:
            self._show_lights()
            self._show_pixel()
        if self._changed and self._widget is not None:
            self._changed = False
            self.app.later("scene", self._push)

    def _push(self) -> None:
        """Draws the view and sends it. It is encoded beside the event loop: asked for now, the last image comes."""
        server = self.app.server
        if server.protocol is None:
            return
        self._widget.update()
        protocol, _ = server.protocol.getRPCMethod("viewport.image.push")
        name = str(protocol.get_global_id(self.view.plotter.render_window))

        def ask() -> None:
            # The library itself asks again after half a second.
            if self._view is not None and protocol.stale_handler_count.get(name, 0) > 0:
                protocol.push_render(name)

        for seconds in ENCODING_SECONDS:
            asyncio.get_running_loop().call_later(seconds, ask)

    def _show_lights(self) -> None:
        app, view, state = self.app, self.app.view, self.state
        frame = app.frame
        if frame is None:
            return
        hierarchy, top = frame.hierarchy, frame.hierarchy.top
        levels = tuple(level for level in view.levels if level <= top)
        state.top_level, state.shown_levels = top, list(levels)
        state.slider_level = levels[0] if len(levels) == 1 else -1
        state.level_items = [
            {"value": level.level, "title": f"{level.level}", "doc": f"level {level.level}: {len(level):,} lights"}
            for level in hierarchy.levels
        ]
        state.cell_items = [{"title": "no cells", "value": -1}] + [
            {"title": f"cells of level {level}", "value": level} for level in range(1, top + 1)
        ]
        cells = view.cells if view.cells <= top else -1
        state.cells = cells
        lights = frame.lights if view.vpls else None
        self._part("vpls", (id(frame.lights), view.vpls), lambda: self.view.show_vpls(lights))
        self._part(
            "levels", (id(hierarchy), levels, view.colour_by),
            lambda: self.view.show_levels(hierarchy, set(levels), view.colour_by),
        )  # fmt: skip
        self._part("cells", (id(hierarchy), cells), lambda: self._show_cells(cells))

        def select() -> None:
            index = app.light
            members = None if index is None else member_shares(hierarchy, index, frame.params)
            self.view.select_light(hierarchy, index, frame.params, members)

        self._part("light", (id(hierarchy), app.light, frame.params.alpha, frame.params.lobe), select)

    def _show_cells(self, level: int) -> None:
        frame = self.app.frame
        if frame is not None:
            self.state.scene_note = self.view.show_cells(frame.hierarchy, None if level < 0 else level)

    def _show_pixel(self) -> None:
        probe, frame = self.app.probe, self.app.frame

        self._part("pixel", (id(frame), self.app.pixel), lambda: self.view.show_probe(probe))

    def _part(self, name: str, key: Hashable, draw: Callable[[], None]) -> None:
        if name not in self._drawn or self._drawn[name] != key:
            draw()
            self._drawn[name], self._changed = key, True

    def _look(self) -> None:
        numbers = self.app.view.scene_camera
        if numbers is None:
            self.view.look_from(self.app.workbench.camera_of(self.app.workbench.settings.camera))
        else:
            eye, target, up = (tuple(numbers[i : i + 3]) for i in (0, 3, 6))
            self.view.look_from(Camera("view", eye, target, up, self.view.camera.fov_y_deg))  # type: ignore[arg-type]
        self._looked = self._place()

    def screenshot(self) -> bytes:
        """The view as it is."""
        return png_bytes(self.view.screenshot())

    def close(self) -> None:
        """Frees the window."""
        if self._view is not None:
            self._navigation.close()
            self._view.close()
            self._view = None

    # --- what the user does -------------------------------------------------------------------------

    def _click(self, x: int, y: int) -> None:
        """A click at (x, y), pixels from the upper left, selects the light there, or probes the surface's pixel."""
        picked = self.view.pick(x, y)
        if picked is None:
            return
        if picked[0] == "light":
            self.app.select_light(int(picked[1]))
        else:
            self._probe_point(picked[1])

    def _probe_point(self, point: Any) -> None:
        """Probes the pixel that shows a point of the surface, where the picture sees it."""
        frame = self.app.frame
        if frame is None:
            return
        pixel = pixel_of_point(frame.gbuffer, point)
        if pixel is None:
            self.app.say("the picture's camera does not see that point", "info")
            return
        self.app.select_pixel(pixel)

    def _settle(self) -> None:
        """The view has stopped: everything is drawn again, and its place is kept where it is another."""
        self.view.set_moving(False)
        self._changed = True
        numbers = self._place()
        if numbers == self._looked:
            self.app.refresh()
            return
        self._drawn["eye"], self._looked = numbers, numbers
        self.app.look(scene_camera=numbers)

    def _place(self) -> tuple[float, ...]:
        """Where the view looks from and to, and what is up: nine numbers."""
        camera = self.view.camera
        return tuple(float(value) for vector in (camera.eye, camera.target, camera.up) for value in vector)

    def _render_from_here(self) -> None:
        """The picture looks from where the scene is seen."""
        camera = self.view.camera
        vectors = (",".join(f"{value:.6g}" for value in vector) for vector in (camera.eye, camera.target, camera.up))
        self.app.choose_camera(":".join([*vectors, f"{camera.fov_y_deg:.6g}"]))

    def _fly(self, where: str) -> None:
        app = self.app
        probe, light = app.probe, app.light
        if where == "camera":
            self.app.look(scene_camera=None)
            return
        if where == "pixel" and probe is not None and probe.depth > 0:
            self.view.fly_to(probe.point)
        elif where == "light" and light is not None and app.frame is not None:
            self.view.fly_to(app.frame.hierarchy.position[light])
        else:
            app.say(f"no {where} is selected to fly to", "info")
            return
        self._changed = True
        self._settle()

    # --- widgets ------------------------------------------------------------------------------------

    def _choices(self) -> None:
        look = self.app.look
        with html.Div(classes="lab-choices lab-one-row"):
            with v3.VBtnToggle(
                model_value=("shown_levels", []), multiple=True, density="compact", variant="outlined",
                update_modelValue=(lambda levels: look(levels=tuple(sorted(levels))), "[$event]"), id="levels",
            ):  # fmt: skip
                v3.VBtn(
                    "{{ item.title }}", v_for="item in level_items", key="item.value", value=("item.value",),
                    size="x-small", title=("item.doc",), classes="lab-level",
                )  # fmt: skip
            v3.VSlider(
                model_value=("slider_level", 1), min=0, max=("top_level",), step=1, density="compact",
                hide_details=True, thumb_size=14, id="level-slider", classes="lab-slider",
                update_modelValue=(self._slide, "[$event]"), title="show this level alone",
            )  # fmt: skip
            self._options()
            _icon("mdi-map-legend", "legend on, off", self._explain, "legend-shown")
            for where, icon, title in (
                ("camera", "mdi-camera", "look from the picture's camera"),
                ("pixel", "mdi-crosshairs", "fly to the probed pixel"),
                ("light", "mdi-lightbulb-on-outline", "fly to the selected light"),
            ):
                _icon(icon, title, (self._fly, f"['{where}']"), f"fly-{where}")
            _icon("mdi-image-outline", "render the picture from here", self._render_from_here, "render-here")

    def _options(self) -> None:
        """What is shown less often, in a menu."""
        look = self.app.look
        with v3.VMenu(close_on_content_click=False, location="bottom end"):
            with html.Template(v_slot_activator="{ props }"):
                v3.VBtn(
                    icon="mdi-tune", title="what the scene shows", size="x-small", variant="text", v_bind="props",
                    id="scene-options",
                )  # fmt: skip
            with v3.VCard(classes="lab-options"):
                self._select("colour_by", list(COLOUR_BYS), "colour lights by", lambda name: look(colour_by=name))
                self._select("cells", ("cell_items",), "cells", lambda level: look(cells=int(level)))
                self._select("mesh", list(MESH_STYLES), "mesh", lambda name: look(mesh=name))
                v3.VSlider(
                    model_value=("opacity", 1.0), min=0.05, max=1, step=0.05, density="compact", hide_details=True,
                    thumb_size=12, id="opacity", label="opacity", end=(lambda value: look(opacity=float(value)),
                    "[$event]"),
                )  # fmt: skip
                v3.VCheckbox(
                    label="input lights (VPLs)", model_value=("vpls_shown", False), density="compact",
                    hide_details=True, id="vpls-shown",
                    update_modelValue=(lambda on: look(vpls=bool(on)), "[$event]"),
                )  # fmt: skip

    def _explain(self) -> None:
        """The legend, on and off."""
        self.app.look(legend=not self.app.view.legend)

    def _select(self, name: str, items: Any, label: str, choose: Callable[[Any], None]) -> None:
        v3.VSelect(
            model_value=(name, None), items=items if isinstance(items, tuple) else (f"{items}",), label=label,
            update_modelValue=(choose, "[$event]"), id=name.replace("_", "-"), classes="lab-scene-select", **DENSE,
        )  # fmt: skip

    def _slide(self, level: float) -> None:
        if level >= 0:
            self.app.look(levels=(int(level),))


def _icon(icon: str, title: str, click: object, testid: str) -> None:
    v3.VBtn(icon=icon, title=title, size="x-small", variant="text", click=click, id=testid)
