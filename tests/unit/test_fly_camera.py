"""The camera that flies: angles and ways against what geometry says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.scene.fly_camera import STEEPEST, FlyCamera, camera_argument, camera_toml
from lab.scene.override import parse_camera
from lab.scene.scene import Camera
from lab.scene.scene_toml import read_scene_toml

from ..conftest import write_quads

LEVEL = Camera("level", (1.0, 2.0, 3.0), (1.0, 2.0, 1.0), fov_y_deg=50.0)  # looks along -z
UPS = [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.3, 1.0, -0.4)]
finite = st.floats(-100, 100)


def rotated(vector: np.ndarray, axis: np.ndarray, degrees: float) -> np.ndarray:
    """Rodrigues' formula."""
    a, k = math.radians(degrees), axis / np.linalg.norm(axis)
    return vector * math.cos(a) + np.cross(k, vector) * math.sin(a) + k * (k @ vector) * (1 - math.cos(a))


@pytest.mark.parametrize("up", UPS)
def test_it_begins_with_the_view_it_is_given(up: tuple[float, float, float]) -> None:
    before = Camera("c", (3.0, -2.0, 5.0), (-1.0, 0.5, 2.0), up, 63.0)
    after = FlyCamera.of(before).camera("c")
    np.testing.assert_allclose(after.target, before.target, atol=1e-12)
    np.testing.assert_allclose(np.cross(after.up, before.up), 0, atol=1e-12)
    assert np.dot(after.up, before.up) > 0
    assert (after.eye, after.fov_y_deg, after.name) == (before.eye, 63.0, "c")


def test_the_ways_of_a_level_camera() -> None:
    fly = FlyCamera.of(LEVEL)
    np.testing.assert_allclose(fly.forward, (0, 0, -1), atol=1e-15)
    np.testing.assert_allclose(fly.right, (1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(fly.moved(2, 0, 0).eye, (1, 2, 1), atol=1e-15)
    np.testing.assert_allclose(fly.moved(0, 0.5, 0).eye, (1.5, 2, 3), atol=1e-15)
    np.testing.assert_allclose(fly.moved(0, 0, -1).eye, (1, 1, 3), atol=1e-15)
    np.testing.assert_allclose(fly.turned(90, 0).forward, (1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(fly.turned(0, 30).forward, (0, 0.5, -math.sqrt(0.75)), atol=1e-15)


@pytest.mark.parametrize("up", UPS)
@given(right=st.floats(-400, 400), more=st.floats(-80, 80))
def test_turning_is_a_rotation_about_up_and_then_about_right(
    up: tuple[float, float, float], right: float, more: float
) -> None:
    start = FlyCamera.of(Camera("c", (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), up))
    axis = np.asarray(up)
    level = FlyCamera.of(start.camera()).turned(0, -math.degrees(start.pitch))
    fly = level.turned(right, more)
    heading = rotated(np.asarray(level.forward), axis, -right)
    side = rotated(np.asarray(level.right), axis, -right)
    np.testing.assert_allclose(fly.right, side, atol=1e-9)
    np.testing.assert_allclose(fly.forward, rotated(heading, side, more), atol=1e-9)


@given(turns=st.lists(st.tuples(finite, finite), max_size=8), ways=st.tuples(finite, finite, finite))
def test_no_walk_bends_the_axes_or_the_horizon(turns: list[tuple[float, float]], ways: tuple[float, ...]) -> None:
    fly = FlyCamera.of(LEVEL)
    for right, up in turns:
        fly = fly.turned(right, up)
    axes = np.array([fly.forward, fly.right, np.cross(fly.right, fly.forward)])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert abs(np.dot(fly.right, fly.up)) < 1e-12
    assert abs(fly.pitch) <= STEEPEST
    there = fly.moved(*ways)
    back = there.moved(*(-way for way in ways))
    np.testing.assert_allclose(back.eye, fly.eye, atol=1e-10)
    assert np.linalg.norm(np.subtract(there.eye, fly.eye)) == pytest.approx(
        np.linalg.norm(np.asarray(fly.forward) * ways[0] + np.asarray(fly.right) * ways[1] + [0, ways[2], 0])
    )


def test_looking_up_ends_short_of_the_zenith() -> None:
    fly = FlyCamera.of(LEVEL).turned(0, 500)
    assert math.degrees(fly.pitch) == pytest.approx(89)
    fly.camera()  # not along "up", which no camera may look
    assert math.degrees(fly.turned(0, -1000).pitch) == pytest.approx(-89)


def test_a_camera_that_looks_down_with_another_up() -> None:
    plan = Camera("plan", (0.0, 10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    np.testing.assert_allclose(FlyCamera.of(plan).forward, (0, -1, 0), atol=1e-15)
    np.testing.assert_allclose(FlyCamera.of(plan).right, (1, 0, 0), atol=1e-15)


def test_what_is_printed_can_be_read(tmp_path_factory: pytest.TempPathFactory) -> None:
    camera = FlyCamera.of(LEVEL).turned(33, -12).moved(1.25, -0.5, 0.25).camera("here")
    again = parse_camera(camera_argument(camera))
    scene = write_quads(tmp_path_factory.mktemp("printed"), camera=camera_toml(camera) + "\n")
    block = read_scene_toml(scene).cameras[0]
    for other in (again, block):
        for name in ("eye", "target", "up"):
            np.testing.assert_allclose(getattr(other, name), getattr(camera, name), atol=1e-5)
        assert other.fov_y_deg == 50.0
    assert block.name == "here"
    assert "-0," not in camera_argument(LEVEL) and camera_argument(LEVEL) == "1,2,3:1,2,1:0,1,0:50"
