"""The panel over the picture: times, layer, settings and camera, made from the settings' own metadata."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lab.engine.vulkan.adapters import import_slangpy
from lab.engine.vulkan.window.panel_state import PanelActions, PanelState
from lab.engine.vulkan.window.setting_widgets import SettingWidget, put, wrapped
from lab.layers import find_layer
from lab.params import GROUPS, PRESETS

if TYPE_CHECKING:
    import slangpy as spy

_WIDTH, _EDGE = 480, 10
_TALLEST = 1000


class Panel:
    """The panel's widgets. They are made once; :meth:`show` gives them what they show."""

    def __init__(self, screen: spy.ui.Screen, actions: PanelActions, size: tuple[int, int], state: PanelState) -> None:
        """`size`: of the window, in pixels."""
        spy = import_slangpy()
        self._ui: Any = spy.ui
        self._actions = actions
        self._explained = False
        self._group = next(iter(GROUPS))
        height = min(_TALLEST, max(size[1] - 2 * _EDGE, 80))
        corner, extent = spy.float2(_EDGE, _EDGE), spy.float2(min(_WIDTH, max(size[0] - 2 * _EDGE, 120)), height)
        self.window = self._ui.Window(screen, "lab view   (tab hides this, h tells the keys)", corner, extent)
        self._message = self._ui.Text(self.window, "")
        self._keys = self._text("keys")
        self._times = self._text("frame")
        self._add_picture(state)
        self._add_settings(state)
        self._add_camera(state)
        self._lights = self._text("grid lights")

    @property
    def visible(self) -> bool:
        """Whether it is on the screen."""
        return bool(self.window.visible)

    @visible.setter
    def visible(self, on: bool) -> None:
        self.window.visible = on

    def show(self, state: PanelState) -> None:
        """Everything as `state` has it."""
        put(self._message, "visible", bool(state.message))
        put(self._message, "text", wrapped(f"! {state.message}"))
        for (group, text), lines in zip(
            (self._times, self._lights, self._keys), (state.times, state.lights, state.keys), strict=True
        ):
            put(group, "visible", bool(lines))
            put(text, "text", "\n".join(lines))
        self._show_picture(state)
        self._show_settings(state)
        put(self._camera, "value", state.cameras.index(state.camera) if state.camera in state.cameras else 0)
        put(self._speed, "value", state.speed)

    def _text(self, title: str) -> tuple[Any, Any]:
        group = self._ui.Group(self.window, title)
        return group, self._ui.Text(group, "")

    # --- the picture ------------------------------------------------------------------------------

    def _add_picture(self, state: PanelState) -> None:
        ui, group = self._ui, self._ui.Group(self.window, "picture")
        self._heading = ui.ComboBox(group, "layers", 0, self._choose_heading, items=[])
        self._layer = ui.ComboBox(group, "layer", 0, self._choose_layer, items=[])
        self._about = ui.Text(group, "")
        self._exposure = ui.SliderFloat(
            group, "exposure (e)", state.exposure, self._actions.set_exposure,
            min=state.exposure / 64, max=state.exposure * 64, format="%.4g", flags=ui.SliderFlags.logarithmic,
        )  # fmt: skip
        ui.Button(group, "exposure that suits this picture (f)", lambda: self._actions.press("f"))
        self._shown_layers: tuple[str, ...] = ()

    def _show_picture(self, state: PanelState) -> None:
        layer = find_layer(state.layer)
        self._shown_layers = state.layers
        headings = self._headings()
        names = self._names(layer.group)
        put(self._heading, "items", headings)
        put(self._heading, "value", headings.index(layer.group))
        put(self._layer, "items", [f"{number}  {find_layer(name).title}" for number, name in enumerate(names, 1)])
        put(self._layer, "value", names.index(state.layer))
        unit = f" [{layer.unit}]" if layer.unit else ""
        put(self._about, "text", wrapped(f"{layer.doc}{unit}\n{state.scale}".rstrip()))
        put(self._exposure, "value", state.exposure)

    def _headings(self) -> list[str]:
        return list(dict.fromkeys(find_layer(name).group for name in self._shown_layers))

    def _names(self, heading: str) -> list[str]:
        return [name for name in self._shown_layers if find_layer(name).group == heading]

    def _choose_heading(self, number: int) -> None:
        self._actions.choose_layer(self._names(self._headings()[number])[0])

    def _choose_layer(self, number: int) -> None:
        heading = self._headings()[self._heading.value]
        self._actions.choose_layer(self._names(heading)[number])

    # --- the settings -----------------------------------------------------------------------------

    def _add_settings(self, state: PanelState) -> None:
        ui, group = self._ui, self._ui.Group(self.window, "settings")
        self._preset = ui.ComboBox(group, "preset", 0, self._choose_preset, items=list(PRESETS))
        titles = list(GROUPS)
        self._titles = ui.ComboBox(group, "settings of", 0, self._choose_group, items=titles)
        ui.CheckBox(group, "explain them", False, self._explain)
        self._groups = {title: ui.Group(group, title) for title in titles}
        self._settings = {
            name: SettingWidget(self._groups[title], name, self._actions.set)
            for title, names in GROUPS.items()
            for name in names
        }
        for title, names in GROUPS.items():
            ui.Button(
                self._groups[title], "these as the preset has them", lambda names=names: self._actions.reset(names)
            )
        ui.Button(group, "all as the preset has them", lambda: self._actions.reset(tuple(self._settings)))
        self._options = {
            name: ui.CheckBox(group, name, on, lambda on, name=name: self._actions.set_option(name, on))
            for name, on in state.options.items()
        }

    def _show_settings(self, state: PanelState) -> None:
        put(self._preset, "value", list(PRESETS).index(state.preset))
        values, usual = state.params.to_dict(), state.usual.to_dict()
        for title, group in self._groups.items():
            put(group, "visible", title == self._group)
        for name, widget in self._settings.items():
            widget.show(values[name], usual[name], self._explained)
        for name, on in state.options.items():
            put(self._options[name], "value", on)

    def _choose_preset(self, number: int) -> None:
        self._actions.choose_preset(list(PRESETS)[number])

    def _choose_group(self, number: int) -> None:
        self._group = list(GROUPS)[number]

    def _explain(self, on: bool) -> None:
        self._explained = on

    # --- the camera -------------------------------------------------------------------------------

    def _add_camera(self, state: PanelState) -> None:
        ui, group = self._ui, self._ui.Group(self.window, "camera")
        self._camera = ui.ComboBox(group, "from", 0, self._choose_camera, items=list(state.cameras))
        self._cameras = state.cameras
        self._speed = ui.SliderFloat(
            group, "scene radii a second", state.speed, self._actions.set_speed, min=0.002, max=10, format="%.3g",
            flags=ui.SliderFlags.logarithmic,
        )  # fmt: skip
        ui.Button(group, "back to its start (r)", lambda: self._actions.press("r"))
        ui.Button(group, "print it (p)", lambda: self._actions.press("p"))
        ui.Button(group, "save the picture (f12)", lambda: self._actions.press("f12"))

    def _choose_camera(self, number: int) -> None:
        self._actions.choose_camera(self._cameras[number])
