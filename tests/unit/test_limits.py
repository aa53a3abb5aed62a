"""What the machine could do at best: plausible, and of the very work that a frame has."""

from __future__ import annotations

import pytest

import lab
from lab import _core
from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.scene.scene import PointLight

from ..oracle_geometry.scenes import occluded_room, wall_lights


def test_streaming_has_a_speed() -> None:
    assert 1e8 < _core.stream_rate(2**24, 3) < 1e13


@pytest.mark.parametrize("size", [8, 24, 4096, 100_001])
def test_any_size_can_be_streamed(size: int) -> None:
    assert _core.stream_rate(size, 1) > 0


@pytest.mark.parametrize("arguments", [(7, 1), (0, 1), (64, 0)])
def test_streaming_needs_something_to_read(arguments: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="stream_rate"):
        _core.stream_rate(*arguments)


@pytest.mark.parametrize("bounces", [1, 3])
def test_every_light_ends_a_ray(bounces: int) -> None:
    """In a closed room each ray leaves a light, until there are enough of them: paths are begun some at a time."""
    engine = CpuEngine(occluded_room(points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 3.0))]))
    params = Params(vpls=3000, max_bounces=bounces)
    lights = engine.trace_vpls(params)
    found = _core.limit_vpl_rays(engine._core_scene, params.to_core(), 2)
    assert len(lights) <= found["rays"] <= 3 * len(lights)
    assert 0 < found["seconds"] < 10


def test_a_list_of_lights_takes_no_rays() -> None:
    engine = CpuEngine(occluded_room(wall_lights(4, 30)))
    frame = lab.render(engine.scene, Params(), size=(8, 4), engine=engine)
    assert engine.embree_alone("trace_vpls", frame) == (0, 0.0)
    assert engine.embree_alone("render_gbuffer", frame)[0] == 32
