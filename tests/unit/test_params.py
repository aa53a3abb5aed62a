"""Params: what is read, what is refused and in which words, presets, and the numbers the core gets."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest

from lab.errors import LabError
from lab.params import PRESETS, SETTINGS, Params, Setting, parse_assignments, preset


def refused(**settings) -> str:
    """The message a bad setting gets."""
    with pytest.raises(LabError) as caught:
        Params().replace(**settings)
    message = str(caught.value)
    assert "\n" not in message
    return message


DEFAULTS = {
    "vpls": 100000, "max_bounces": 3, "bounds_scale": 1, "levels": "auto", "construction": "gather",
    "gather_range": "inclusive", "carry_moments": True, "centre_weight": "flux", "lobe": "moments", "receiver": "hard",
    "alpha": 1, "first_level": 0, "falloff": "clamped", "clamp_distance": 0.01, "shadow_samples": 4,
    "first_shadow_level": 0, "importance": True, "picker": "reservoir", "shadow_points": "members",
    "deviation_scale": 0.5, "shadow_estimator": "ratio", "omega_max": 8, "member_candidates": 3, "interleave": 1,
    "filter": "atrous_variance", "filter_backend": "fused", "direct_samples": 4, "seed": 0, "frame": 0,
    "compensation": "none", "compensation_samples": 4, "deal_all": False, "lighting": "tiled",
    "reservoir_locks": "atomic_race",
}  # fmt: skip


def test_defaults_are_the_documented_ones():
    values = Params().to_dict()
    assert {name: values[name] for name in DEFAULTS} == DEFAULTS
    sigmas = {f"sigma_{guide}" for guide in ("deviation", "shadow", "normal", "position", "plane")}
    assert set(values) - set(DEFAULTS) == sigmas


def test_every_setting_explains_itself():
    for name, setting in SETTINGS.items():
        assert len(setting.doc) > 10 and setting.allowed(), name
        default = getattr(Params(), name)
        assert setting.check(name, default) == default
        assert setting.check(name, str(default)) == default, "the default is read back from its own text"


@pytest.mark.parametrize("name, text, value", [
    ("vpls", "1000", 1000), ("vpls", "1e5", 100000), ("vpls", str(2**31), 2**31), ("vpls", 7.0, 7),
    ("alpha", "2", 2.0), ("alpha", "1e-6", 1e-6), ("alpha", 3, 3.0), ("alpha", "1e6", 1e6),
    ("levels", "auto", "auto"), ("levels", "demo", "demo"), ("levels", "12", 12), ("levels", 1, 1),
    ("importance", "false", False), ("importance", "True", True), ("deal_all", True, True),
    ("omega_max", "none", "none"), ("omega_max", "0.5", 0.5), ("sigma_normal", "none", "none"),
    ("interleave", "8", 8), ("first_level", "1", 1), ("clamp_distance", "0", 0.0), ("shadow_samples", "0", 0),
    ("lobe", "mean_energy", "mean_energy"), ("filter", "none", "none"), ("seed", str(2**32 - 1), 2**32 - 1),
    ("bounds_scale", "1", 1.0), ("deviation_scale", "2", 2.0), ("sigma_deviation", "none", "none"),
    ("sigma_deviation", "1e30", 1e30), ("filter", "atrous", "atrous"), ("compensation", "path", "path"),
])  # fmt: skip
def test_what_is_read(name, text, value):
    read = getattr(Params().replace(**{name: text}), name)
    assert read == value and type(read) is type(value)


@pytest.mark.parametrize("name, values", {
    "alpha": ["0", "nan", "-1", "inf", "abc", "", "1e7", True, None, 0],
    "vpls": ["0", "-1", "abc", "1.5", str(2**31 + 1), "nan", "inf", True, "", "1e20"],
    "max_bounces": [0, 17], "bounds_scale": [0.99, 2.01, "nan"], "levels": [0, 13, 99, "-1", "most", 2.5, True],
    "interleave": [3, 0, 16, "-2", 1.5], "shadow_samples": [-1, 65, "x"], "clamp_distance": [-1, "nan", "-0.001"],
    "first_level": [2, -1, 0.5], "first_shadow_level": [-1, 13], "filter": ["magic", "", "Atrous", 1],
    "lobe": ["means", None], "importance": ["yes", "1", 1, 0, "maybe"], "omega_max": [0, -1, "inf", "nan", "off"],
    "deviation_scale": [-0.1, 2.1], "seed": [-1, 2**32], "frame": [2**32, 0.5], "sigma_shadow": [0, -1, "nan"],
    "construction": ["scattered"], "picker": [True], "direct_samples": [65], "compensation": ["paths", True],
    "compensation_samples": [0, 65, 1.5], "sigma_deviation": [0, -1, "nan", "inf", "off"],
}.items())  # fmt: skip
def test_what_is_refused(name, values):
    for value in values:
        message = refused(**{name: value})
        assert message.startswith(f"{name}={value}: allowed is "), "what was given"
        assert SETTINGS[name].allowed() in message and SETTINGS[name].doc in message


@pytest.mark.parametrize("name, allowed", [
    ("alpha", "a number > 0 and <= 1000000"),
    ("vpls", "a whole number from 1 to 2147483648"),
    ("levels", "a whole number from 1 to 12 | auto | demo"),
    ("interleave", "1 | 2 | 4 | 8"),
    ("importance", "true or false"),
    ("omega_max", "a number > 0 | none"),
    ("filter", "atrous_variance | atrous | atrous_plane | bilateral | none"),
    ("sigma_deviation", "a number > 0 | none"),
    ("clamp_distance", "a number from 0 to 1000000"),
])  # fmt: skip
def test_allowed_values_in_words(name, allowed):
    assert SETTINGS[name].allowed() == allowed


def test_the_nearest_word_is_offered():
    assert "did you mean 'atrous_plane'?" in refused(filter="atrous_plan")
    assert "did you mean 'moments'?" in refused(lobe="moment")
    assert "did you mean" not in refused(filter="zzzzzz")


@pytest.mark.parametrize("wrong, right", [
    ("alhpa", "alpha"), ("interlave", "interleave"), ("shadow_sample", "shadow_samples"), ("Vpls", "vpls"),
])  # fmt: skip
def test_the_nearest_name_is_offered(wrong, right):
    message = refused(**{wrong: 1})
    assert repr(wrong) in message and f"did you mean {right!r}?" in message and "lab params" in message


def test_params_cannot_be_changed_in_place():
    params = Params()
    with pytest.raises(dataclasses.FrozenInstanceError):
        params.alpha = 2
    assert params.replace(alpha=2).alpha == 2 and params.alpha == 1


def test_equal_settings_are_equal():
    assert Params(alpha="2") == Params(alpha=2.0) != Params(alpha=3)
    assert hash(Params(alpha="2")) == hash(Params(alpha=2.0))


@pytest.mark.parametrize("name", PRESETS)
def test_settings_survive_json(name):
    params = preset(name, omega_max="none", vpls=12345)
    assert Params(**json.loads(json.dumps(params.to_dict()))) == params


PAPER = {
    "lobe": "mean", "first_level": 1, "first_shadow_level": 2, "reservoir_locks": "none", "shadow_points": "jitter",
    "shadow_estimator": "average", "deal_all": True, "filter": "atrous",
}  # fmt: skip
DEMO = PAPER | {
    "bounds_scale": 1.1, "levels": "demo", "gather_range": "half_open", "carry_moments": False,
    "centre_weight": "count", "falloff": "softened", "shadow_estimator": "ratio_rgb",
}  # fmt: skip


@pytest.mark.parametrize("name, changes", [("ours", {}), ("paper", PAPER), ("demo", DEMO)])
def test_presets_change_what_the_table_says(name, changes):
    assert preset(name).to_dict() == Params().to_dict() | changes
    assert preset(name, alpha=2).alpha == 2, "settings go over the preset"


def test_unknown_presets_are_refused():
    with pytest.raises(LabError, match=r"unknown preset 'papr': there are ours, paper, demo; did you mean 'paper'\?"):
        preset("papr")
    with pytest.raises(LabError, match="is not a setting"):
        preset("paper", alhpa=2)
    with pytest.raises(LabError, match="alpha=0"):
        preset("demo", alpha=0)


def test_the_core_gets_numbers_for_words():
    core = Params().to_core()
    assert core["levels"] == 0 and isinstance(core["levels"], int)
    assert Params(levels="demo").to_core()["levels"] == -1 and Params(levels=7).to_core()["levels"] == 7
    assert Params(omega_max="none").to_core()["omega_max"] == math.inf and core["omega_max"] == 8.0
    for guide in ("plane", "deviation"):
        assert Params(**{f"sigma_{guide}": "none"}).to_core()[f"sigma_{guide}"] == math.inf
    assert set(core) == set(SETTINGS)
    assert core["lobe"] == "moments" and core["importance"] is True
    words = {name for name, setting in SETTINGS.items() if setting.words}
    assert all(core[name] == value for name, value in Params().to_dict().items() if name not in words)


def test_assignments():
    assert parse_assignments([]) == {}
    assert parse_assignments(["alpha=2", " filter = none "]) == {"alpha": "2", "filter": "none"}
    assert parse_assignments(["a=b=c"]) == {"a": "b=c"}
    assert parse_assignments(["alpha=1", "alpha=3"]) == {"alpha": "3"}, "the last one counts"
    for wrong in ("alpha", "=2", ""):
        with pytest.raises(LabError, match="expected name=value"):
            parse_assignments([wrong])


def test_open_bounds():
    setting = Setting("a test of bounds", float, low=0, open_low=True)
    assert setting.check("x", "1e-300") == 1e-300
    with pytest.raises(LabError, match="a number > 0"):
        setting.check("x", 0.0)
