"""A setting of the panel: one widget, or two where a word stands beside numbers."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from lab.controls import CHECK, CHOICE, ENTRY, Control, control_of, describe, shown_value
from lab.engine.vulkan.adapters import import_slangpy
from lab.params import Value

if TYPE_CHECKING:
    import slangpy as spy

LINE = 62
"""Letters that fit a line of the panel."""

_MOST = 2**31 - 1  # of a slider of whole numbers

Set = Callable[[str, Value], None]


class SettingWidget:
    """Shows a setting and changes it. ``* `` before its name: it is not as the preset has it."""

    def __init__(self, parent: spy.ui.Widget, name: str, change: Set) -> None:
        ui = import_slangpy().ui
        self.control: Control = control_of(name)
        self._change = change
        self._switch: Any = None
        if self.control.word:
            label = f"{name} = {self.control.word}"
            self._switch = ui.CheckBox(parent, label, False, self._switched)
        self.widget: Any = self._made(ui, parent)
        self._explanation: Any = ui.Text(parent, wrapped(describe(name), indent="    "))
        self._explanation.visible = False

    def show(self, value: Value, usual: Value, explained: bool) -> None:
        """The value, and whether the explanation is shown."""
        mark = "" if value == usual else "* "
        put(self.widget, "label", mark + self.control.name)
        put(self._explanation, "visible", explained)
        if self._switch is not None:
            on = isinstance(value, str)
            put(self._switch, "value", on)
            put(self.widget, "enabled", not on)
            if on:
                return
        put(self.widget, "value", self._to_widget(value))

    def _made(self, ui: Any, parent: spy.ui.Widget) -> Any:
        control = self.control
        if control.kind == CHECK:
            return ui.CheckBox(parent, control.name, False, self._changed)
        if control.kind == CHOICE:
            return ui.ComboBox(parent, control.name, 0, self._changed, items=list(map(str, control.items)))
        if control.kind == ENTRY:
            flags = ui.InputTextFlags.enter_returns_true
            return ui.InputText(parent, control.name, "", self._changed, flags=flags)
        flags = ui.SliderFlags.logarithmic if control.logarithmic else ui.SliderFlags.none
        ends = {"min": control.low, "max": control.high}
        if control.whole:
            whole = {name: min(int(end), _MOST) for name, end in ends.items()}
            return ui.SliderInt(parent, control.name, whole["min"], self._changed, **whole, flags=flags)
        return ui.SliderFloat(parent, control.name, control.low, self._changed, **ends, format="%.4g", flags=flags)

    def _to_widget(self, value: Value) -> Any:
        if self.control.kind == CHOICE:
            return self.control.items.index(value)
        if self.control.kind == ENTRY:
            return shown_value(value)
        return min(int(value), _MOST) if self.control.whole else value

    def _changed(self, value: Any) -> None:
        if self.control.kind == CHOICE:
            value = self.control.items[value]
        elif isinstance(value, float):
            value = float(f"{value:.6g}")  # 0.1, not the float32 beside it
        self._change(self.control.name, value)

    def _switched(self, on: bool) -> None:
        usual = (self.control.low * self.control.high) ** 0.5 if self.control.logarithmic else self.control.low
        self._change(self.control.name, self.control.word if on else float(f"{usual:.3g}"))


def put(widget: Any, name: str, value: Any) -> None:
    """Sets what is not so yet."""
    if getattr(widget, name) != value:
        setattr(widget, name, value)


def wrapped(text: str, indent: str = "") -> str:
    """`text` in lines that fit the panel."""
    lines = [textwrap.fill(line, LINE, initial_indent=indent, subsequent_indent=indent) for line in text.splitlines()]
    return "\n".join(lines)
