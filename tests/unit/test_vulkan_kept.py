"""A renderer keeps what the device made, where it is, and makes anew what a change touches."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lab
from lab.engine import STAGES
from lab.engine.dependencies import draws_members, outdated_by, stages_touched
from lab.engine.kept import Made
from lab.engine.vulkan.buffers import BufferPool
from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.kept import KeptOnDevice
from lab.params import Params
from lab.records import Frame
from lab.scene.scene import Camera, PointLight

from ..oracle_geometry.scenes import occluded_room, wall_lights
from .test_frame import differences

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (20, 12)
SMALL = Params(vpls=300)
SCENE = occluded_room(points=[PointLight((0.9, 1.7, 0.9), (1.0, 2.0, 3.0))])


class Run:
    """Frames of one engine, with what it keeps."""

    def __init__(self, engine: VulkanEngine) -> None:
        self.engine = engine
        self.kept: dict[str, Made] = {}
        self.ran: tuple[str, ...] = ()

    def render(self, params: Params = SMALL, camera: Camera = CAMERA, counts: bool = False) -> Frame:
        stages = KeptOnDevice(self.engine, self.kept)
        frame = lab.render(self.engine.scene, params, camera=camera, size=SIZE, engine=stages, counts=counts)
        self.ran = tuple(stage for stage in STAGES if stage in stages.ran)
        return frame

    def fresh(self, params: Params = SMALL, camera: Camera = CAMERA, counts: bool = False) -> Frame:
        return lab.render(self.engine.scene, params, camera=camera, size=SIZE, engine=self.engine, counts=counts)


@pytest.fixture(scope="module")
def engine(gpu: Any) -> VulkanEngine:
    return VulkanEngine(SCENE, gpu)


@pytest.fixture
def run(engine: VulkanEngine) -> Run:
    return Run(engine)


@pytest.mark.parametrize(
    "change",
    [
        {"vpls": 200},
        {"bounds_scale": 1.5},
        {"alpha": 2.0},
        {"omega_max": 2.0},
        {"filter": "none"},
        {"shadow_points": "jitter"},
        {"shadow_samples": 0},
        {"seed": 3},
        {"frame": 2},
        {"filter_backend": "fused"},
    ],
    ids=str,
)
def test_a_changed_setting_counts(run: Run, change: dict[str, Any]) -> None:
    first = run.render()
    assert run.ran == STAGES
    params = SMALL.replace(**change)
    again = run.render(params)
    # Levels with member lists and without are two records here.
    lists = ("build_hierarchy",) if draws_members(params) != draws_members(SMALL) else ()
    assert set(run.ran) == {*stages_touched(SMALL, params), *outdated_by(*lists)}
    assert differences(again, run.fresh(params)) == []
    back = run.render()
    assert differences(back, first) == []
    run.render()
    assert run.ran == ()


def test_another_camera_keeps_the_lights(run: Run) -> None:
    run.render()
    other = Camera("d", (1.5, 1.1, 1.7), (-0.3, 0.8, -0.4))
    frame = run.render(camera=other)
    assert run.ran == STAGES[2:]
    assert differences(frame, run.fresh(camera=other)) == []


def test_counts_are_made_when_they_are_asked_for(run: Run) -> None:
    assert run.render().lighting.overdraw is None
    counted = run.render(counts=True)
    assert run.ran == STAGES[3:]
    assert counted.lighting.overdraw is not None and np.any(counted.lighting.overdraw)
    assert differences(counted, run.fresh(counts=True)) == []


def test_a_light_list_is_kept_too(gpu: Any) -> None:
    run = Run(VulkanEngine(occluded_room(wall_lights(1, 300)), gpu))
    run.render()
    again = run.render(SMALL.replace(alpha=2.0))
    assert "build_hierarchy" not in run.ran and "light" in run.ran
    assert differences(again, run.fresh(SMALL.replace(alpha=2.0))) == []


def test_nothing_is_read_back_to_find_out(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    run.render()

    def refuse(*_: object) -> None:
        raise AssertionError("something was read back")

    monkeypatch.setattr(BufferPool, "download", refuse)
    run.render()
    run.render(SMALL.replace(filter="none"))
    run.render(SMALL.replace(filter="none"), camera=Camera("d", (1.5, 1.1, 1.7), (-0.3, 0.8, -0.4)))


@pytest.mark.usefixtures("gpu")
def test_the_renderer_keeps_what_a_device_made() -> None:
    with lab.Renderer(SCENE, engine="vulkan") as renderer:

        def ran(**more: Any) -> tuple[str, ...]:
            frame = renderer.render(CAMERA, SIZE, SMALL, **more)
            return tuple(stage for stage, ms in frame.stages_ms.items() if ms > 0)

        assert ran() == STAGES
        assert ran() == ()
        assert ran(anew=("render_gbuffer",)) == STAGES[2:]
        assert ran(anew=("filter_shadows",)) == STAGES[5:]
        assert ran(regenerate=True) == STAGES
