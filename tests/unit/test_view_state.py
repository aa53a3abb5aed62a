"""What keys and panel do to the view: no window, no device."""

from __future__ import annotations

import numpy as np
import pytest

from lab.engine.vulkan.window.inputs import Inputs, Press
from lab.engine.vulkan.window.layer_values import layer_names, needs_counts
from lab.layers import find_layer
from lab.params import Params, preset
from lab.scene.scene import Camera
from lab.view.flight import LONGEST_STEP, Flight
from lab.view.keys import KEYS, key_lines, key_table
from lab.view.settings import ViewSettings
from lab.view.shown_layer import ShownLayer
from lab.view.times import Times
from lab.view.viewer import NEW_NOISE, Viewer

from ..oracle_geometry.scenes import occluded_room

CAMERA = Camera("start", (0.0, 0.0, 0.0), (0.0, 0.0, -2.0))
RADIUS = 10.0


def keys(*names: str, shift: bool = False) -> Inputs:
    return Inputs(pressed=tuple(Press(name, shift) for name in names))


def held(*names: str, **more: object) -> Inputs:
    return Inputs(held=frozenset(names), **more)  # type: ignore[arg-type]


@pytest.fixture
def viewer() -> Viewer:
    made = Viewer(occluded_room(), ViewSettings(Params(vpls=100), "ours"), RADIUS)
    made.layer.offer(layer_names(Params(), 3))
    return made


# --- flying -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("down", "way"),
    [
        (["w"], (0, 0, -1)),
        (["s"], (0, 0, 1)),
        (["a"], (-1, 0, 0)),
        (["d"], (1, 0, 0)),
        (["space"], (0, 1, 0)),
        (["q"], (0, -1, 0)),
        (["w", "d"], (1, 0, -1)),
        (["w", "s"], (0, 0, 0)),
        (["w", "shift"], (0, 0, -4)),
        (["e"], (0, 0, 0)),
    ],
)
def test_keys_move_the_camera(down: list[str], way: tuple[float, ...]) -> None:
    flight = Flight(CAMERA, RADIUS)
    flight.speed = 0.5
    flight.fly(held(*down), 0.05)
    np.testing.assert_allclose(flight.camera.eye, np.multiply(way, 0.5 * RADIUS * 0.05), atol=1e-12)


def test_e_is_up_while_looking_around() -> None:
    flight = Flight(CAMERA, RADIUS)
    flight.fly(held("e", looking=True), 0.05)
    assert flight.camera.eye[1] > 0


def test_the_way_does_not_depend_on_the_frame_rate() -> None:
    quick, slow = Flight(CAMERA, RADIUS), Flight(CAMERA, RADIUS)
    for _ in range(40):
        quick.fly(held("w", "d"), 0.0025)
    slow.fly(held("w", "d"), 0.1)
    np.testing.assert_allclose(quick.camera.eye, slow.camera.eye, atol=1e-9)
    slower = Flight(CAMERA, RADIUS)
    slower.fly(held("w", "d"), 30.0)
    np.testing.assert_allclose(slower.camera.eye, slow.camera.eye, atol=1e-9)
    assert LONGEST_STEP == 0.1


def test_the_mouse_looks_and_its_wheel_changes_the_speed() -> None:
    flight = Flight(CAMERA, RADIUS)
    flight.fly(Inputs(look=(600.0, 0.0)), 0.01)  # 90 degrees to the right
    np.testing.assert_allclose(flight.camera.target, (2, 0, 0), atol=1e-9)
    flight.fly(Inputs(look=(0.0, -200.0)), 0.01)  # the mouse went up
    assert flight.camera.target[1] == pytest.approx(2 * np.sin(np.radians(30)))
    before = flight.speed
    flight.fly(Inputs(wheel=3.0), 0.01)
    assert flight.speed == pytest.approx(before * 1.25**3)
    flight.fly(Inputs(wheel=-3.0), 0.01)
    assert flight.speed == pytest.approx(before)


def test_until_it_moves_the_camera_is_the_scenes_own(viewer: Viewer) -> None:
    start = viewer.scene.camera()
    viewer.step(Inputs(), 1.0)
    assert viewer.flight.camera is start
    viewer.step(held("w"), 0.05)
    assert viewer.flight.camera.eye != start.eye
    viewer.step(keys("r"), 0.05)
    assert viewer.flight.camera is start
    viewer.choose_camera(start.name)
    assert viewer.flight.camera is start


# --- layers -------------------------------------------------------------------------------------------


def test_tevs_keys_walk_through_the_layers() -> None:
    shown = ShownLayer()
    shown.offer(layer_names(Params(shadow_samples=2), 2))
    seen = []
    for key in ("2", "right", "left", "left", "left", "down", "1", "up", "up", "9"):
        assert shown.press(key)
        seen.append(shown.name)
    assert seen == [
        "direct", "indirect", "direct", "colour", "unshadowed", "shadow_ratio", "shadow_ratio", "colour",
        "picked_level.0", "picked_level.0",
    ]  # fmt: skip
    assert not shown.press("w") and not shown.press("0")


def test_a_layer_that_is_gone_gives_way() -> None:
    shown = ShownLayer()
    shown.offer(layer_names(Params(interleave=2), 2))
    shown.choose("tile")
    assert shown.name == "tile"
    shown.choose("left_out")
    assert shown.name == "tile", "it is not offered"
    shown.offer(layer_names(Params(), 2))
    assert shown.name == "colour"


def test_the_layers_of_a_frame() -> None:
    plain = layer_names(Params(shadow_samples=0, first_level=1), 3)
    assert [name for name in plain if name.startswith("overdraw")] == [
        "overdraw", "overdraw.L1", "overdraw.L2", "overdraw.L3",
    ]  # fmt: skip
    assert not {"tile", "irradiance", "left_out", "shadowed", "picked_level.0"} & set(plain)
    rich = layer_names(Params(shadow_samples=3, interleave=4, compensation="path"), 3)
    assert {"tile", "irradiance", "left_out", "shadowed_noisy", "pick_probability.2", "lights_used.L0"} <= set(rich)
    assert all(find_layer(name) for name in rich)
    assert [name for name in ("overdraw", "overdraw.L2", "lights_used", "colour", "depth") if needs_counts(name)] == [
        "overdraw", "overdraw.L2", "lights_used",
    ]  # fmt: skip


# --- settings -----------------------------------------------------------------------------------------


def test_a_refused_value_leaves_the_settings_as_they_are() -> None:
    settings = ViewSettings(Params(alpha=2.0), "ours")
    settings.set("alpha", -1.0)
    assert settings.params.alpha == 2.0 and "alpha" in settings.message
    settings.set("alpha", 3.0)
    assert settings.params.alpha == 3.0 and settings.message == ""


def test_settings_that_no_frame_can_have_give_way_to_the_last_good_ones() -> None:
    settings = ViewSettings(Params(), "ours")
    settings.set("alpha", 3.0)
    settings.accept()
    settings.set("vpls", 2**31)
    settings.refuse("out of memory")
    assert settings.params == Params(alpha=3.0) and settings.message == "out of memory"


def test_presets_and_resets() -> None:
    settings = ViewSettings(Params(vpls=100, seed=7), "ours")
    settings.set("vpls", 5)
    settings.set("alpha", 2.0)
    settings.reset(("vpls",))
    assert settings.params == Params(vpls=100, alpha=2.0, seed=7)
    settings.choose_preset("paper")
    assert settings.params == settings.usual == preset("paper", seed=7) and settings.preset == "paper"


def test_new_noise_counts_frames(viewer: Viewer) -> None:
    viewer.step(Inputs(), 0.1)
    assert viewer.settings.params.frame == 0
    viewer.set_option(NEW_NOISE, True)
    viewer.step(Inputs(), 0.1)
    viewer.step(Inputs(), 0.1)
    assert viewer.settings.params.frame == 2
    viewer.settings.params = viewer.settings.params.replace(frame=2**32 - 1)
    viewer.step(Inputs(), 0.1)
    assert viewer.settings.params.frame == 0


# --- other keys ---------------------------------------------------------------------------------------


def test_exposure_goes_by_half_stops(viewer: Viewer) -> None:
    viewer.exposure = 1.0
    viewer.step(keys("e", "e"), 0.1)
    assert viewer.exposure == pytest.approx(2.0)
    viewer.step(keys("e", shift=True), 0.1)
    assert viewer.exposure == pytest.approx(2**0.5)
    viewer.step(Inputs(pressed=(Press("e"),), held=frozenset("e"), looking=True), 0.05)
    assert viewer.exposure == pytest.approx(2**0.5), "it flies up then"


def test_what_the_loop_is_to_do(viewer: Viewer) -> None:
    viewer.step(keys("f", "f12", "tab"), 0.1)
    assert viewer.wanted == {"fit", "save", "panel"}
    viewer.press("p")
    assert viewer.said[0].startswith("--camera 0,1,3:") and "[[camera]]" in viewer.said[0]
    assert viewer.panel_state((), (), "").keys == ()
    viewer.press("h")
    assert viewer.panel_state((), (), "").keys == key_lines()
    viewer.press("escape")
    assert not viewer.running


def test_every_key_is_told() -> None:
    told = " ".join(key for key, _ in KEYS).replace(",", " ").split()
    for key in ("w", "a", "s", "d", "space", "q", "shift", "e", "r", "p", "f", "f12", "tab", "h", "escape", "right"):
        assert key in told
    assert len(key_table().splitlines()) == len(KEYS) == len(key_lines())


# --- times --------------------------------------------------------------------------------------------


def test_times_are_smoothed_for_the_eye_and_medians_for_the_record() -> None:
    times = Times()
    assert times.lines() == ()
    for frame, light in ((10.0, 1.0), (20.0, 2.0), (1000.0, 90.0)):
        times.add_frame(frame)
        times.add_stages(
            {"light": light, "build_hierarchy": 5.0}, {"light"} | ({"build_hierarchy"} if light == 1 else set())
        )
    assert times.medians() == {"build_hierarchy": 5.0, "light": 2.0, "frame": 20.0}
    assert 10 < times.frame_ms < 1000 and 1 < times.stages_ms["light"] < 90
    said = times.lines()
    assert "5.000 ms   build_hierarchy  (kept)" in said
    assert said[-1] == f"{times.stages_ms['light']:.2f} ms   together", "what was kept took no time"
