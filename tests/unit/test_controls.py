"""Every setting can be changed by hand, within what it allows."""

from __future__ import annotations

import pytest

from lab.controls import CHECK, CHOICE, ENTRY, SLIDER, control_of, describe, label, shown_value
from lab.params import PRESETS, SETTINGS, Params, preset

DEFAULTS = Params().to_dict()


@pytest.mark.parametrize("name", SETTINGS)
def test_a_control_reaches_allowed_values_and_the_presets(name: str) -> None:
    control, setting = control_of(name), SETTINGS[name]
    assert control.name == name
    values = [preset(chosen).to_dict()[name] for chosen in PRESETS]
    if control.kind == CHECK:
        assert setting.kind is bool
    elif control.kind == CHOICE:
        assert set(values) <= set(control.items)
        for item in control.items:
            assert setting.check(name, item) == item
    elif control.kind == SLIDER:
        assert setting.kind in (int, float) and control.whole == (setting.kind is int)
        for end in (control.low, control.high):
            setting.check(name, int(end) if control.whole else end)
        assert control.low < control.high and (control.low > 0 or not control.logarithmic)
        for value in values:
            assert control.low <= value <= control.high if not isinstance(value, str) else value == control.word
        assert not setting.words or list(setting.words) == [control.word]
    else:
        assert control.kind == ENTRY and setting.kind in (int, float) and not setting.words


def test_kinds_fit_what_is_changed() -> None:
    assert control_of("alpha").kind == SLIDER and control_of("alpha").logarithmic
    assert (control_of("alpha").low, control_of("alpha").high) == (1 / 32, 32)
    assert control_of("vpls").logarithmic and control_of("vpls").whole and control_of("vpls").low == 3125
    assert not control_of("shadow_samples").logarithmic and control_of("shadow_samples").low == 0
    assert control_of("bounds_scale").low == 1 and control_of("bounds_scale").high == 2
    assert control_of("levels").items == ("auto", "demo", *range(1, 13))
    assert control_of("interleave").items == (1, 2, 4, 8)
    assert control_of("sigma_normal").word == "none"
    assert control_of("seed").kind == ENTRY


@pytest.mark.parametrize("name", SETTINGS)
def test_words_about_a_setting(name: str) -> None:
    said = describe(name)
    assert said.startswith(SETTINGS[name].doc) and SETTINGS[name].allowed() in said
    assert f"default: {shown_value(DEFAULTS[name])}" in said
    assert label(name).startswith(name)


def test_values_as_people_write_them() -> None:
    assert [shown_value(v) for v in (True, 0.01, 3, "none", 100000.0)] == ["true", "0.01", "3", "none", "100000"]
