"""``lab.engine.dependencies``: the table names all that a stage reads, and nothing else."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from lab.engine import STAGES
from lab.engine.dependencies import STAGE_INPUTS, STAGE_SETTINGS, outdated_by, stages_touched
from lab.errors import LabError
from lab.params import SETTINGS, Params
from lab.records import Frame

from .test_frame import CAMERA, arrays, engine, frame

SIZE = (20, 12)

# Under which other settings a setting counts, and another value of it. What isn't named here: some other value.
RGB = {"shadow_estimator": "ratio_rgb"}
WITNESS: dict[str, tuple[dict[str, Any], Any]] = {
    "max_bounces": ({"compensation": "path", "clamp_distance": 0.2}, 1),
    "levels": ({}, 2),
    "alpha": (RGB, 2.0),
    "first_level": (RGB, 1),
    "lobe": (RGB, "mean"),
    "receiver": (RGB, "soft"),
    "falloff": (RGB, "softened"),
    "clamp_distance": (RGB, 0.2),
    "interleave": (RGB, 2),
    "deal_all": (RGB | {"interleave": 8}, True),
    "shadow_samples": ({}, 0),
    "deviation_scale": ({"shadow_points": "jitter"}, 1.0),
    "omega_max": ({}, 0.1),
    "compensation_samples": ({"compensation": "path", "clamp_distance": 0.2}, 1),
    "sigma_shadow": ({"filter": "atrous"}, 0.1),
    "sigma_plane": ({"filter": "atrous_plane"}, 2.0),
    "sigma_deviation": ({"sigma_position": 0.1}, 0.1),
    "sigma_normal": ({"sigma_position": 0.1}, 0.01),
    "sigma_position": ({}, 0.1),
    "filter_backend": ({}, "kornia"),
}

BASES: list[dict[str, Any]] = [
    {"compensation": "path", "clamp_distance": 0.2},
    {**RGB, "shadow_points": "jitter", "interleave": 2, "receiver": "soft", "filter": "atrous_plane"},
    {"shadow_estimator": "corrected", "construction": "scatter", "picker": "race", "filter": "bilateral"},
]


def other_value(name: str, value: Any) -> Any:
    """Another value of a setting, near `value`."""
    setting = SETTINGS[name]
    if setting.kind is bool:
        return not value
    if setting.choices:
        return next(choice for choice in setting.choices if choice != value)
    if isinstance(value, str):
        return 3
    candidates = (value + 1, value / 2, value + 0.5)
    return next(c for c in candidates if setting.low <= c <= setting.high)


@cache
def made(settings: tuple[tuple[str, Any], ...]) -> Frame:
    return frame(SIZE, **dict(settings))


def inputs_of(stage: str, f: Frame) -> tuple[Any, ...]:
    records = {
        "trace_vpls": f.lights,
        "build_hierarchy": f.hierarchy,
        "render_gbuffer": f.gbuffer,
        "light": f.lighting,
        "trace_shadow_rays": f.shadows,
        "filter_shadows": f.filtered,
    }
    return tuple(records[name] for name in STAGE_INPUTS[stage])


def result(stage: str, f: Frame, params: Params) -> dict[str, Any] | None:
    """The arrays that a stage makes of the inputs in `f` with other settings; None where it refuses them."""
    try:
        record = getattr(engine(), stage)(*inputs_of(stage, f), params)
    except (TypeError, LabError):
        return None
    return dict(arrays(record))


def same(a: dict[str, Any] | None, b: dict[str, Any] | None) -> bool:
    return a is not None and b is not None and a.keys() == b.keys() and all(np.array_equal(a[n], b[n]) for n in a)


# reservoir_locks is read by the Vulkan engine alone: see test_vulkan_light_raster.py.
READ = [(stage, name) for stage, names in STAGE_SETTINGS.items() for name in names if name != "reservoir_locks"]


@pytest.mark.parametrize(("stage", "name"), READ, ids=str)
def test_a_stage_reads_what_the_table_says(stage: str, name: str) -> None:
    if name == "filter_backend":
        pytest.importorskip("kornia")
    base, value = WITNESS.get(name, ({}, None))
    f = made(tuple(base.items()))
    value = other_value(name, f.params.to_dict()[name]) if value is None else value
    assert not same(result(stage, f, f.params), result(stage, f, f.params.replace(**{name: value})))


@pytest.mark.parametrize("base", BASES, ids=str)
@pytest.mark.parametrize("stage", [stage for stage in STAGES if stage != "render_gbuffer"])
def test_a_stage_reads_nothing_else(stage: str, base: dict[str, Any]) -> None:
    f = made(tuple(base.items()))
    before = result(stage, f, f.params)
    for name, value in f.params.to_dict().items():
        if name not in STAGE_SETTINGS[stage]:
            params = f.params.replace(**{name: other_value(name, value)})
            assert same(before, result(stage, f, params)), name


def test_every_setting_is_read_somewhere() -> None:
    assert set(SETTINGS) == {name for names in STAGE_SETTINGS.values() for name in names}
    assert tuple(STAGE_SETTINGS) == tuple(STAGE_INPUTS) == STAGES


def test_what_comes_after() -> None:
    assert outdated_by("trace_vpls") == tuple(stage for stage in STAGES if stage != "render_gbuffer")
    assert outdated_by("render_gbuffer") == STAGES[2:]
    assert outdated_by("filter_shadows") == ("filter_shadows", "composite")
    assert outdated_by("composite") == ("composite",) and outdated_by() == ()


@pytest.mark.parametrize(
    ("change", "touched"),
    [
        ({"sigma_normal": 0.5}, ("filter_shadows", "composite")),
        ({"filter": "none"}, ("filter_shadows", "composite")),
        ({"omega_max": 2.0}, STAGES[4:]),
        ({"alpha": 2.0}, STAGES[3:]),
        ({"frame": 1}, STAGES[3:]),
        ({"shadow_samples": 2}, STAGES[3:]),
        ({"levels": 3}, ("build_hierarchy", *STAGES[3:])),
        ({"seed": 1}, ("trace_vpls", "build_hierarchy", *STAGES[3:])),
        ({"shadow_points": "jitter"}, STAGES[4:]),
        ({"shadow_samples": 0}, STAGES[3:]),
        ({}, ()),
    ],
    ids=str,
)
def test_stages_touched(change: dict[str, Any], touched: tuple[str, ...]) -> None:
    assert stages_touched(Params(), Params(**change)) == touched


def test_member_lists_alone() -> None:
    """Drawing members after jittering needs their lists, not another hierarchy."""
    assert stages_touched(Params(shadow_points="jitter"), Params()) == ("build_hierarchy", *STAGES[4:])


def test_the_camera_is_one_input_of_the_gbuffer() -> None:
    """It reads no setting: the same camera and size give the same records."""
    a, b = (dict(arrays(engine().render_gbuffer(CAMERA, SIZE))) for _ in range(2))
    assert same(a, b)
