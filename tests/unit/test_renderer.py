"""``lab.Renderer``: the frames of ``lab.render``, with less work and with memory that is used again."""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
import pytest

import lab
from lab import LabError, _core
from lab.engine import STAGES
from lab.params import SETTINGS, Params
from lab.scene.scene import Camera, PointLight

from ..oracle_geometry.scenes import occluded_room, wall_lights
from .test_frame import differences

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
OTHER = Camera("d", (1.5, 1.1, 1.7), (-0.3, 0.8, -0.4), fov_y_deg=70.0)
SIZE = (20, 12)
SMALL = Params(vpls=300)
SCENE = occluded_room(points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 3.0))])


def changed(name: str) -> Any:
    """Another value of this setting than SMALL's, near it."""
    setting, value = SETTINGS[name], SMALL.to_dict()[name]
    if setting.kind is bool:
        return not value
    if setting.choices:
        return next(choice for choice in setting.choices if choice not in (value, "kornia"))
    if isinstance(value, str):
        return 3
    candidates = (value + 1, value / 2, value + 0.5)
    return next(c for c in candidates if setting.low <= c <= setting.high)


@pytest.mark.parametrize("name", [name for name in SETTINGS if name != "filter_backend"])
def test_a_changed_setting_counts(name: str) -> None:
    """Whatever is kept from the frame before: the next one is the frame that a fresh start gives."""
    params = SMALL.replace(**{name: changed(name)})
    with lab.Renderer(SCENE) as renderer:
        renderer.render(CAMERA, SIZE, SMALL, counts=True)
        again = renderer.render(CAMERA, SIZE, params, counts=True)
        back = renderer.render(CAMERA, SIZE, SMALL, counts=True)
    assert differences(again, lab.render(SCENE, params, camera=CAMERA, size=SIZE)) == []
    assert differences(back, lab.render(SCENE, SMALL, camera=CAMERA, size=SIZE)) == []


def test_another_camera_needs_no_new_lights() -> None:
    with lab.Renderer(SCENE) as renderer:
        first = renderer.render(CAMERA, SIZE, SMALL)
        second = renderer.render(OTHER, SIZE, SMALL)
        third = renderer.render(OTHER, (10, 6), SMALL)
        fourth = renderer.render(OTHER, (10, 6), SMALL, regenerate=True)
    assert second.lights is first.lights and second.hierarchy is first.hierarchy
    assert second.gbuffer is not first.gbuffer and third.gbuffer.size == (10, 6)
    assert fourth.lights is not third.lights and fourth.gbuffer is not third.gbuffer
    assert differences(second, lab.render(SCENE, SMALL, camera=OTHER, size=SIZE, counts=False)) == []
    assert differences(fourth, third) == []
    assert tuple(second.stages_ms) == STAGES


def test_lights_are_counted_only_if_asked() -> None:
    with lab.Renderer(SCENE) as renderer:
        plain, counted = (renderer.render(CAMERA, SIZE, SMALL, counts=counts) for counts in (False, True))
    assert plain.lighting.overdraw is None and plain.lighting.lights_used is None
    np.testing.assert_array_equal(plain.image.colour, counted.image.colour)
    used = int(counted.lighting.counts()[1].sum(dtype=np.int64))
    with pytest.raises(LabError, match="counts"):
        plain.lighting.counts()
    assert 0 < used <= counted.lighting.visited == plain.lighting.visited


def test_new_lights_need_a_new_hierarchy() -> None:
    with lab.Renderer(SCENE) as renderer:
        first = renderer.render(CAMERA, SIZE, SMALL)
        second = renderer.render(CAMERA, SIZE, SMALL.replace(seed=1))
    assert second.hierarchy is not first.hierarchy and second.gbuffer is first.gbuffer


def test_light_lists() -> None:
    lights = wall_lights(4, 30)
    with lab.Renderer(occluded_room(lights)) as renderer:
        frames = [renderer.render(camera, SIZE) for camera in (CAMERA, OTHER)]
    assert all(frame.lights is lights for frame in frames)
    assert frames[0].hierarchy is frames[1].hierarchy


def test_its_threads_are_its_own() -> None:
    before = _core.info()["threads"]
    seen: list[int] = []
    with lab.Renderer(SCENE, threads=before + 1) as renderer:
        assert _core.info()["threads"] == before
        one = renderer.render(CAMERA, SIZE, SMALL, progress=lambda _: seen.append(_core.info()["threads"]))
    assert set(seen) == {before + 1} and _core.info()["threads"] == before
    assert differences(one, lab.render(SCENE, SMALL, camera=CAMERA, size=SIZE, counts=False)) == []


def test_memory_is_kept_until_it_closes() -> None:
    with lab.Renderer(SCENE) as renderer:
        frame = renderer.render(CAMERA, (640, 480), SMALL)
        colour = frame.image.colour.copy()
        held = frame.image
        del frame
        gc.collect()
        in_use = _core.buffer_bytes()
        for _ in range(2):
            renderer.render(CAMERA, (640, 480), SMALL, regenerate=True)
        assert _core.buffer_bytes()["most_in_use"] <= 2 * max(in_use["most_in_use"], 1)
    assert _core.buffer_bytes()["kept"] == 0
    np.testing.assert_array_equal(held.colour, colour)


def test_a_forgotten_renderer_keeps_nothing() -> None:
    renderer = lab.Renderer(SCENE)
    renderer.render(CAMERA, (640, 480), SMALL)
    del renderer
    gc.collect()
    assert _core.buffer_bytes()["kept"] == 0


def test_a_closed_renderer_says_so() -> None:
    renderer = lab.Renderer(SCENE)
    renderer.close()
    renderer.close()
    with pytest.raises(LabError, match="closed"):
        renderer.render(CAMERA, SIZE, SMALL)


@pytest.mark.parametrize("threads", [0, -1, 1.5])
def test_threads_are_checked(threads: Any) -> None:
    with pytest.raises(LabError, match="threads"):
        lab.Renderer(SCENE, threads=threads)


def test_bad_input_is_refused_as_by_render() -> None:
    with lab.Renderer(SCENE) as renderer:
        with pytest.raises(LabError, match="size"):
            renderer.render(CAMERA, (0, 4), SMALL)
        with pytest.raises(LabError, match="camera"):
            renderer.render("frnt", SIZE, SMALL)
    with pytest.raises(LabError, match="cpu"):
        lab.Renderer(SCENE, engine="cpus")
