"""The settings of a frame: a field for each, made from the metadata of :class:`lab.Params` and checked by it."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from gui.panels.panel import DENSE, Panel
from lab import LabError
from lab.controls import describe, label
from lab.params import GROUPS, PRESETS, SETTINGS, Setting


class ParamsPanel(Panel):
    """Presets, camera, size and all settings. A refused value stays in its field, red, with the reason."""

    def build(self) -> None:
        """One expansion panel a group of settings."""
        self.state.params = {}
        self.state.param_errors = {}
        self.state.param_changed = []
        self.state.presets = list(PRESETS)
        self.state.cameras = [camera.name for camera in self.app.workbench.scene.cameras]
        with html.Div(classes="lab-params", id="params"):
            self._frame_row()
            with v3.VExpansionPanels(
                multiple=True, variant="accordion", model_value=("[2, 3]",), elevation=0, static=True
            ):
                for title, names in GROUPS.items():
                    with v3.VExpansionPanel(), html.Template(v_slot_default=True):
                        v3.VExpansionPanelTitle(title, classes="lab-group")
                        with v3.VExpansionPanelText():
                            for name in names:
                                self._field(name)

    def show(self) -> None:
        """The fields show the settings of the workbench."""
        settings = self.app.workbench.settings
        values = settings.params.to_dict()
        with self.state:
            self.state.params = {name: _shown(value) for name, value in values.items()}
            self.state.param_errors = {}
            self.state.param_changed = sorted(self.app.workbench.changed_settings())
            self.state.preset = settings.preset
            self.state.camera = settings.camera or self.app.workbench.scene.camera().name
            self.state.size = "x".join(map(str, settings.size))
            self.state.undo_steps, self.state.redo_steps = self.app.workbench.steps

    def set(self, name: str, value: object) -> None:
        """A field was changed: the frame is rendered anew, or the field says why not."""
        try:
            self.app.workbench.change(**{name: SETTINGS[name].check(name, value)})
        except LabError as error:
            with self.state:
                self.state.params = self.state.params | {name: _shown(value)}
                self.state.param_errors = self.state.param_errors | {name: str(error)}
            return
        self.app.settings_changed()

    def set_size(self, text: object) -> None:
        """The picture's size as WIDTHxHEIGHT."""
        sides = str(text).lower().replace(" ", "").split("x")
        numbers = [int(side) for side in sides if side.isdecimal() and len(side) <= 4]
        if len(sides) != 2 or len(numbers) != 2 or not all(16 <= side <= 4096 for side in numbers):
            with self.state:
                self.state.size = str(text)
                self.state.param_errors = self.state.param_errors | {
                    "size": f"size {text}: expected WIDTHxHEIGHT, each from 16 to 4096 pixels, for example 640x360"
                }
            return
        self.app.workbench.change(size=(numbers[0], numbers[1]))
        self.app.settings_changed()

    def _frame_row(self) -> None:
        with html.Div(classes="lab-frame-row"):
            v3.VSelect(
                label="preset", model_value=("preset", "ours"), items=("presets",), id="preset", **DENSE,
                update_modelValue=(self.app.choose_preset, "[$event]"),
            )  # fmt: skip
            v3.VSelect(
                label="camera", model_value=("camera", ""), items=("cameras",), id="camera", **DENSE,
                update_modelValue=(self.app.choose_camera, "[$event]"),
            )  # fmt: skip
            v3.VTextField(
                label="size", model_value=("size", ""), error=("!!param_errors.size",), id="size", **DENSE,
                change=(self.set_size, "[$event.target.value]"), title="pixels of the picture",
            )  # fmt: skip
            html.Div("{{ param_errors.size }}", v_if=("param_errors.size",), classes="lab-error")

    def _field(self, name: str) -> None:
        setting = SETTINGS[name]
        with html.Div(classes="lab-field", title=describe(name)):
            html.Label(
                label(name),
                classes=(f"param_changed.includes('{name}') ? 'lab-name lab-changed' : 'lab-name'",),
            )
            if setting.kind is bool:
                v3.VSwitch(
                    model_value=(f"params.{name}",), color="primary", density="compact", hide_details=True,
                    id=f"param-{name}", update_modelValue=(self.set, f"['{name}', $event]"),
                )  # fmt: skip
            elif setting.choices and not setting.words:
                self._choice(name, setting)
            else:
                self._number(name)
            html.Div(f"{{{{ param_errors.{name} }}}}", v_if=(f"param_errors.{name}",), classes="lab-error")

    def _choice(self, name: str, setting: Setting) -> None:
        self.state[f"choices_{name}"] = list(setting.choices)
        v3.VSelect(
            model_value=(f"params.{name}",), items=(f"choices_{name}",), id=f"param-{name}", **DENSE,
            update_modelValue=(self.set, f"['{name}', $event]"),
        )  # fmt: skip

    def _number(self, name: str) -> None:
        v3.VTextField(
            model_value=(f"params.{name}",), error=(f"!!param_errors.{name}",), id=f"param-{name}", **DENSE,
            change=(self.set, f"['{name}', $event.target.value]"),
        )  # fmt: skip


def _shown(value: Any) -> Any:
    """Numbers as people write them: a field must not show 0.009999999776."""
    return f"{value:.12g}" if isinstance(value, float) else value
