"""``lab.Renderer``: the frames of ``lab.render``, with less work and with memory that is used again."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import numpy as np
import pytest

import lab
from lab import LabError, _core
from lab.engine import STAGES
from lab.engine.dependencies import outdated_by, stages_touched
from lab.frame import Progress
from lab.params import SETTINGS, Params
from lab.records import Frame
from lab.renderer import Cancelled
from lab.scene.scene import Camera, PointLight

from ..oracle_geometry.scenes import occluded_room, wall_lights
from .test_frame import arrays, differences
from .test_stage_dependencies import other_value

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
OTHER = Camera("d", (1.5, 1.1, 1.7), (-0.3, 0.8, -0.4), fov_y_deg=70.0)
SIZE = (20, 12)
SMALL = Params(vpls=300)
SCENE = occluded_room(points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 3.0))])


def changed(name: str) -> Any:
    """Another value of this setting than SMALL's, near it."""
    return 3 if name == "levels" else other_value(name, SMALL.to_dict()[name])


def fresh(params: Params = SMALL, camera: Camera = CAMERA, size: tuple[int, int] = SIZE, counts: bool = False) -> Frame:
    return lab.render(SCENE, params, camera=camera, size=size, counts=counts)


def ran(frame: Frame) -> tuple[str, ...]:
    """The stages that a frame did itself."""
    assert tuple(frame.stages_ms) == STAGES
    return tuple(stage for stage, ms in frame.stages_ms.items() if ms > 0)


# The engine cpu, which these frames are of, has no rasteriser.
NAMES = [name for name in SETTINGS if name != "lighting"]


@pytest.mark.parametrize("name", NAMES)
def test_a_changed_setting_counts(name: str) -> None:
    """Whatever is kept from the frame before: the next one is the frame that a fresh start gives, and no more work."""
    if name == "filter_backend":
        pytest.importorskip("kornia")
    params = SMALL.replace(**{name: changed(name)})
    with lab.Renderer(SCENE) as renderer:
        first = renderer.render(CAMERA, SIZE, SMALL, counts=True)
        again = renderer.render(CAMERA, SIZE, params, counts=True)
        same = renderer.render(CAMERA, SIZE, params, counts=True)
        back = renderer.render(CAMERA, SIZE, SMALL, counts=True)
    assert differences(again, fresh(params, counts=True)) == []
    assert differences(back, fresh(counts=True)) == [] and differences(first, back) == []
    assert ran(first) == STAGES and ran(again) == stages_touched(SMALL, params) and ran(same) == ()
    assert same.image is again.image


@pytest.mark.parametrize("seed", range(3))
def test_any_walk_through_settings_and_views(seed: int) -> None:
    """Frames in any order, some broken off: each is the fresh frame, bit for bit."""
    random = np.random.default_rng(seed)
    names = [name for name in NAMES if name != "filter_backend"]
    params, camera, size = SMALL, CAMERA, SIZE
    frames: list[tuple[Frame, Frame]] = []
    with lab.Renderer(SCENE) as renderer:
        for _ in range(40):
            for name in random.choice(names, 2, replace=False):
                value = SMALL.to_dict()[name] if random.random() < 0.5 else changed(str(name))
                params = params.replace(**{str(name): value})
            camera = CAMERA if random.random() < 0.7 else OTHER
            size = SIZE if random.random() < 0.8 else (9, 7)
            counts = bool(random.random() < 0.5)
            if random.random() < 0.3:
                with pytest.raises(Cancelled):
                    renderer.render(camera, size, params, progress=cancel_at(str(random.choice(STAGES))))
                continue
            found = renderer.render(camera, size, params, counts=counts)
            frames.append((found, fresh(params, camera, size, counts)))
    # At the end: a later frame must not have written into an earlier one.
    assert all(differences(found, wanted) == [] for found, wanted in frames)


def cancel_at(stage: str) -> Progress:
    def progress(name: str) -> None:
        if name == stage:
            raise Cancelled

    return progress


@pytest.mark.parametrize("stage", STAGES)
def test_a_cancelled_frame_leaves_the_renderer_right(stage: str) -> None:
    other = SMALL.replace(seed=3, alpha=2.0, sigma_normal=0.5)
    with lab.Renderer(SCENE) as renderer:
        renderer.render(CAMERA, SIZE, SMALL)
        with pytest.raises(Cancelled):
            renderer.render(OTHER, SIZE, other, progress=cancel_at(stage))
        finished = renderer.render(OTHER, SIZE, other)
        back = renderer.render(CAMERA, SIZE, SMALL)
    assert differences(finished, fresh(other, OTHER)) == []
    assert differences(back, fresh()) == []
    assert ran(finished) == STAGES[STAGES.index(stage) :], "what was done before is taken again"


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_that_breaks_off(stage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the midst of a stage: nothing half-done is kept."""

    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    other = SMALL.replace(seed=3, alpha=2.0, sigma_normal=0.5)
    with lab.Renderer(SCENE) as renderer:
        renderer.render(CAMERA, SIZE, SMALL)
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(renderer.engine, stage, pressed)
            renderer.render(OTHER, SIZE, other)
        assert differences(renderer.render(CAMERA, SIZE, SMALL), fresh()) == []
        assert differences(renderer.render(OTHER, SIZE, other), fresh(other, OTHER)) == []


def test_a_frame_within_a_frame() -> None:
    """A progress that renders with other settings itself does not mix them into the frame it belongs to."""
    inner: list[Frame] = []

    def progress(name: str) -> None:
        inner.append(renderer.render(CAMERA, SIZE, SMALL.replace(seed=9, alpha=0.5)))

    with lab.Renderer(SCENE) as renderer:
        outer = renderer.render(CAMERA, SIZE, SMALL, progress=progress)
        after = renderer.render(CAMERA, SIZE, SMALL)
    assert differences(outer, fresh()) == [] and differences(after, fresh()) == []
    assert all(differences(f, fresh(SMALL.replace(seed=9, alpha=0.5))) == [] for f in inner) and len(inner) == 7


def test_what_is_outdated_goes_before_the_new_one_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the moment a stage begins, its last result and all made from it are gone: memory does not pile up."""
    alive: dict[str, weakref.ref[Any]] = {}
    left: dict[str, list[str]] = {}
    with lab.Renderer(SCENE) as renderer:
        for stage in STAGES:
            real = getattr(renderer.engine, stage)

            def spied(*args: Any, stage: str = stage, real: Any = real) -> Any:
                left[stage] = [name for name, ref in alive.items() if ref() is not None]
                record = real(*args)
                alive[stage] = weakref.ref(next(iter(arrays(record)))[1])
                return record

            monkeypatch.setattr(renderer.engine, stage, spied)
        renderer.render(CAMERA, SIZE, SMALL)
        for changes in ({"seed": 1}, {"alpha": 2.0}, {"filter": "none"}):
            left.clear()
            renderer.render(CAMERA, SIZE, SMALL.replace(**changes))
            first = next(iter(left))
            assert left[first] == [stage for stage in STAGES if stage not in outdated_by(first)], changes
        left.clear()
        renderer.render(CAMERA, (8, 4), SMALL.replace(filter="none"))
        assert left["render_gbuffer"] == ["trace_vpls", "build_hierarchy"]


def test_lists_and_counts_alone() -> None:
    """Member lists and counts are added to what is kept, or left out of it; nothing that they don't touch is redone."""
    jitter = SMALL.replace(shadow_points="jitter")
    with lab.Renderer(SCENE) as renderer:
        first = renderer.render(CAMERA, SIZE, jitter)
        listed = renderer.render(CAMERA, SIZE, SMALL)
        plain = renderer.render(CAMERA, SIZE, jitter)
        counted = renderer.render(CAMERA, SIZE, jitter, counts=True)
        uncounted = renderer.render(CAMERA, SIZE, jitter)
    assert ran(listed) == ("build_hierarchy", *STAGES[4:])
    assert ran(plain) == STAGES[4:] and ran(counted) == ("light",) and ran(uncounted) == ()
    assert first.hierarchy.members is None and plain.hierarchy.members is None and listed.hierarchy.members is not None
    assert listed.lighting is first.lighting and counted.shadows is plain.shadows
    assert counted.lighting.overdraw is not None and uncounted.lighting.overdraw is None
    assert differences(listed, fresh()) == [] and differences(plain, fresh(jitter)) == []
    assert differences(counted, fresh(jitter, counts=True)) == [] and differences(uncounted, fresh(jitter)) == []


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
        unread = renderer.render(OTHER, SIZE, Params(vpls=9))
    assert ran(unread) == (), "VPLs are not asked for"
    assert all(frame.lights is lights for frame in frames)
    assert frames[0].hierarchy is frames[1].hierarchy


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


def test_bad_input_is_refused_as_by_render() -> None:
    with lab.Renderer(SCENE) as renderer:
        with pytest.raises(LabError, match="size"):
            renderer.render(CAMERA, (0, 4), SMALL)
        with pytest.raises(LabError, match="camera"):
            renderer.render("frnt", SIZE, SMALL)
    with pytest.raises(LabError, match="cpu"):
        lab.Renderer(SCENE, engine="cpus")


def test_a_renderer_on_the_device_renders_what_lab_render_does(gpu: object) -> None:
    """Again and again, with other settings, and from other cameras."""
    scene, size = occluded_room(wall_lights(3, 60)), (32, 18)
    with lab.Renderer(scene, engine="vulkan") as renderer:
        for params in (Params(picker="race"), Params(picker="race", alpha=2), Params(picker="race", shadow_samples=0)):
            frame = renderer.render(size=size, params=params, counts=True)
            again = lab.render(scene, params, size=size, engine="vulkan")
            np.testing.assert_allclose(frame.image.colour, again.image.colour, rtol=1e-5, atol=1e-6)
            assert set(frame.stages_ms) == set(again.stages_ms)
