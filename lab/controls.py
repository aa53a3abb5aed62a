"""How a person changes a setting: the kind of control and its range, from the setting's own metadata."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

from lab.params import SETTINGS, Params, Setting, Value

CHECK, CHOICE, SLIDER, ENTRY = "check", "choice", "slider", "entry"
"""Kinds: a box to tick, one of a few values, a range to drag in, a number to type."""

_FEW = 16
_REACH = 32.0


@dataclass(frozen=True)
class Control:
    """What changes one setting.

    Attributes:
        name: of the setting.    kind: see :data:`CHECK` and the others.
        items: of a choice, the values in order.
        low, high: of a slider; a value beyond may be typed, the setting itself says what is allowed.
        logarithmic: equal ways are equal ratios.    whole: numbers without a fraction.
        word: of a slider whose setting may also be a word (``none``).

    """

    name: str
    kind: str
    items: tuple[Value, ...] = ()
    low: float = 0.0
    high: float = 0.0
    logarithmic: bool = False
    whole: bool = False
    word: str = ""


@cache
def control_of(name: str) -> Control:
    """The control of a setting."""
    setting, default = SETTINGS[name], Params().to_dict()[name]
    if setting.kind is bool:
        return Control(name, CHECK)
    if setting.choices:
        return Control(name, CHOICE, items=setting.choices)
    if setting.kind is int and setting.words and setting.high - setting.low < _FEW:
        return Control(name, CHOICE, items=(*setting.words, *range(int(setting.low), int(setting.high) + 1)))
    return _of_number(name, setting, default)


def _of_number(name: str, setting: Setting, default: Value) -> Control:
    whole, word = setting.kind is int, next(iter(setting.words), "")
    wide = setting.high - setting.low > (64 if whole else 2)
    if not wide:
        return Control(name, SLIDER, low=setting.low, high=setting.high, whole=whole, word=word)
    usual = float(default) if not isinstance(default, str) else 1.0
    if usual <= 0:  # nothing that a range could be laid around
        return Control(name, ENTRY, whole=whole)
    low, high = max(setting.low, usual / _REACH), min(setting.high, usual * _REACH)
    if whole:
        low, high = float(math.floor(low)), float(math.ceil(high))
    return Control(name, SLIDER, low=low, high=high, logarithmic=True, whole=whole, word=word)


def describe(name: str) -> str:
    """What a setting does, what it may be, and where the paper has it: a few lines."""
    setting, default = SETTINGS[name], Params().to_dict()[name]
    unit = f", in units of {setting.unit}" if setting.unit else ""
    lines = [setting.doc, f"allowed: {setting.allowed()}{unit}", f"default: {shown_value(default)}"]
    if setting.section:
        lines.append(setting.section + (f", symbol {setting.symbol}" if setting.symbol else ""))
    return "\n".join(lines)


def label(name: str) -> str:
    """The setting's name, with the paper's symbol and the unit where there are any."""
    setting = SETTINGS[name]
    symbol = f" ({setting.symbol})" if setting.symbol and setting.symbol != name else ""
    return f"{name}{symbol}" + (f" [{setting.unit}]" if setting.unit else "")


def shown_value(value: Value) -> str:
    """A value as people write it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, float) else str(value)
