"""Stage build_hierarchy on the device against the core: the same levels of the same lights."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lab
from lab import _core
from lab.engine.vulkan import build_hierarchy as building
from lab.engine.vulkan.build_hierarchy import HierarchyBuild, build_hierarchy
from lab.engine.vulkan.hierarchy import device_hierarchy, hierarchy_parts
from lab.engine.vulkan.hierarchy_sizes import COLUMNS, MOST_LEVELS, hierarchy_sizes
from lab.engine.vulkan.layouts import INPUT_LIGHT
from lab.engine.vulkan.lights import LightsParts, device_lights
from lab.engine.vulkan.sort import sort_keys
from lab.frame import render_frame
from lab.params import Params
from lab.records import Hierarchy, Lights

from .vulkan_scenes import engines

EXACT = ("offset", "origin", "cell_size", "vertex", "oriented", "input_index")


def walls(count: int, seed: int = 1) -> Lights:
    """Lights on the six sides of a box, of very different brightness; some without a normal."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal[::7] = 0
    position = rng.random((count, 3))
    position[np.arange(count), rng.integers(0, 3, count)] = rng.integers(0, 2, count)
    return Lights(position * [3, 2, 1] - 0.7, rng.random((count, 3)) ** 4, normal.astype(np.float32))


def black_from(lights: Lights, first: int) -> Lights:
    flux = lights.flux.copy()
    flux[first:] = 0
    return Lights(lights.position, flux, lights.normal)


def coloured(lights: Lights) -> Lights:
    """Half of the lights so faint that their luminance rounds to nothing, though their flux does not."""
    flux = np.where(np.arange(len(lights))[:, None] % 2 == 0, lights.flux, 0).astype(np.float32)
    flux[1::2, 2] = 2.0**-31.5
    position = lights.position.copy()
    position[1::2] += 40
    return Lights(position, flux, lights.normal)


SETS = {
    "one": walls(1),
    "two": walls(2),
    "ten": walls(10),
    "thousand": walls(1000),
    "more": walls(6000, 2),
    "one place": Lights(np.full((50, 3), 7.0), np.ones((50, 3)), np.tile([0, 0, 1], (50, 1)).astype(np.float32)),
    "black": black_from(walls(300), 0),
    "partly black": black_from(walls(300), 100),
    "faint": coloured(walls(400)),
    "on a line": Lights(np.linspace(0, 1, 500)[:, None] * [1.0, 0, 0], np.ones((500, 3))),
    "isotropic": Lights(walls(500).position, walls(500).flux),
}


def assert_same(got: Hierarchy, want: Hierarchy) -> None:
    """The same lights in the same rows, but for rounding; where a light is all but black, its moments are noise."""
    for name in EXACT:
        np.testing.assert_array_equal(getattr(got, name), getattr(want, name), err_msg=name)
    np.testing.assert_allclose(got.flux, want.flux, rtol=1e-5, atol=1e-8 * want.flux.max(initial=0))
    bright = want.flux.max(axis=1) > 1e-8 * want.flux.max(initial=0)
    size = np.repeat(want.cell_size, np.diff(want.offset))[bright, None]
    for name, cells in (("position", 1e-5), ("deviation", 2e-4)):
        apart = np.abs(getattr(got, name) - getattr(want, name))[bright] / size
        assert apart.max(initial=0) < cells, name
    for name in ("normal", "normal_moment"):
        np.testing.assert_allclose(getattr(got, name)[bright], getattr(want, name)[bright], atol=2e-5, err_msg=name)


def both(gpu: Any, lights: Lights, **changes: object) -> tuple[Hierarchy, Hierarchy]:
    params = Params().replace(**{"shadow_points": "jitter", **changes})
    return build_hierarchy(gpu, lights, params), lab.build_hierarchy(lights, params)


@pytest.mark.parametrize("lights", SETS.values(), ids=SETS)
def test_levels_are_those_of_the_core(gpu: Any, lights: Lights) -> None:
    made, want = both(gpu, lights)
    if want.top > MOST_LEVELS:  # the device stops there
        _, want = both(gpu, lights, levels=MOST_LEVELS)
    assert_same(made, want)


@pytest.mark.parametrize(
    "change",
    [
        {"levels": 1},
        {"levels": 5},
        {"levels": 7},
        {"levels": "demo"},
        {"bounds_scale": 1.1},
        {"construction": "scatter"},
        {"gather_range": "half_open"},
        {"carry_moments": False},
        {"centre_weight": "count"},
        {"gather_range": "half_open", "carry_moments": False, "centre_weight": "count"},
        {"construction": "scatter", "centre_weight": "count"},
    ],
    ids=str,
)
def test_every_setting_is_that_of_the_core(gpu: Any, change: dict[str, object]) -> None:
    assert_same(*both(gpu, walls(1500, 3), **change))


@pytest.mark.parametrize("lights", [SETS["one"], SETS["thousand"], SETS["more"], SETS["faint"]], ids=len)
@pytest.mark.parametrize("centre_weight", ["flux", "count"])
def test_the_sums_of_s1_are_the_same_integers(gpu: Any, lights: Lights, centre_weight: str) -> None:
    params = Params(centre_weight=centre_weight)
    made = HierarchyBuild(gpu, lights, params)
    with gpu.stage("build_hierarchy") as encoder:
        made.record_s1(encoder)
    want = _core.s1_sums(lights, params.to_core()).reshape(-1, COLUMNS)
    got = made.sums.numpy(want.size).reshape(want.shape).copy()
    offset = made.parts.on_host["offset"]
    assert offset[2] - offset[1] == len(want)
    got[:, 15] = 0  # marks of the device's own
    np.testing.assert_array_equal(got, want)


def test_the_same_lights_make_the_same_bits_in_any_order(gpu: Any) -> None:
    lights, order = walls(2000, 4), np.random.default_rng(5).permutation(2000)
    shuffled = Lights(lights.position[order], lights.flux[order], lights.normal[order])
    one, other = (build_hierarchy(gpu, each, Params()) for each in (lights, shuffled))
    rows = slice(2000, int(one.offset[2]))
    for name in ("position", "flux", "normal", "normal_moment", "deviation", "vertex"):
        np.testing.assert_array_equal(getattr(one, name)[rows], getattr(other, name)[rows])


def test_lights_may_be_on_the_device_already(gpu: Any) -> None:
    lights = walls(300)
    rows = np.zeros(300, INPUT_LIGHT)
    for name in ("position", "flux", "normal"):
        rows[name] = getattr(lights, name)
    resident = device_lights(LightsParts(gpu.pool.upload(rows, "lights")), 0)
    made = build_hierarchy(gpu, resident, Params())
    assert hierarchy_parts(gpu, made).lights.rows >= 300
    assert_same(made, lab.build_hierarchy(lights, Params(shadow_points="jitter")))


@pytest.mark.parametrize("construction", ["gather", "scatter"])
def test_passes_of_more_threads_than_a_dispatch_may_have(gpu: Any, construction: str) -> None:
    lights, params = walls(700, 8), Params(construction=construction, shadow_samples=0)
    made = HierarchyBuild(gpu, lights, params, most_groups=2)
    with gpu.stage("build_hierarchy") as encoder:
        made.record(encoder)
    assert 8 * len(lights) > 2 * 256
    assert_same(device_hierarchy(made.parts), lab.build_hierarchy(lights, params))


def test_there_is_room_for_a_level_of_more_lights_than_the_finer_one(gpu: Any) -> None:
    """A light of S1 lies between the lights around it, maybe in a cell that has none."""
    apart = Lights(np.random.default_rng(1).random((300, 3)), np.ones((300, 3)))
    got, want = both(gpu, apart, levels=MOST_LEVELS, bounds_scale=1.3)
    counts = np.diff(want.offset)
    assert counts[2] > counts[1] == 8 * 300
    assert_same(got, want)


@pytest.mark.parametrize("room", [10, 900])
def test_lights_without_room_are_told_before_a_picture_is_seen(
    gpu: Any, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    """Rather than a picture without them; nothing is written or read beyond the rows that there are."""
    engine = engines(gpu, "cornell")[0]
    params, camera = Params(vpls=1000, levels=5), engine.scene.cameras[0]
    sizes = hierarchy_sizes(1000, params)
    monkeypatch.setattr(building, "hierarchy_sizes", lambda *_: replace(sizes, capacity=1000 + room))
    frame = render_frame(engine, camera, (16, 9), params, counts=False)
    with pytest.raises(lab.LabError, match=f"more than the {1000 + room} lights .*fewer levels, or --engine cpu"):
        _ = frame.image.colour
    (info,) = hierarchy_parts(gpu, frame.hierarchy).info.numpy()
    assert info["offset"].max() <= 1000 + room


def test_what_the_device_has_no_room_for_is_refused() -> None:
    with pytest.raises(lab.LabError, match=r"levels=11.*at most 10; use fewer, or --engine cpu"):
        hierarchy_sizes(1000, Params(levels=11))
    with pytest.raises(lab.LabError, match="20000000 lights: the Vulkan engine takes at most 8000000;"):
        hierarchy_sizes(20_000_000, Params())
    assert hierarchy_sizes(8_000_000, Params()).slots > 64_000_000
    with pytest.raises(lab.LabError, match=r"8000000 lights, levels=10: .* grid lights, more than"):
        hierarchy_sizes(8_000_000, Params(levels=10))
    with pytest.raises(lab.LabError, match=r"1500000 lights, levels=9: the lists .* slots, .*shadow_points=jitter"):
        hierarchy_sizes(1_500_000, Params(levels=9, gather_range="half_open"))
    assert hierarchy_sizes(100_000, Params()).first_candidate == 6  # 33^3 vertices are under half


@pytest.mark.parametrize("count", [1, 255, 1024, 5000])
@pytest.mark.parametrize("bits", [1, 8, 20, 32])
def test_keys_are_sorted_and_equals_stay_in_order(gpu: Any, count: int, bits: int) -> None:
    keys = np.random.default_rng(6).integers(0, 2 ** min(bits, 12), count).astype(np.uint32)
    keys[::3] <<= max(0, bits - 12)
    rows = np.column_stack([keys, np.arange(count, dtype=np.uint32)]).astype(np.uint32)
    with gpu.stage("sort") as encoder:
        out = sort_keys(gpu, encoder, gpu.pool.upload(rows, "keys"), bits)
    np.testing.assert_array_equal(out.numpy(), rows[np.argsort(keys, kind="stable")])
