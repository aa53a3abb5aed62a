"""The limits of a Vulkan device are measured on the work that the stages do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lab
from lab.engine.vulkan.limit_light import LightLimit
from lab.engine.vulkan.limits import Rays, StreamLimit, gbuffer_rays, shadow_rays, vpl_rays
from lab.params import Params

from .vulkan_scenes import engines

SIZE = (48, 32)
SETTINGS = Params(vpls=500, shadow_samples=2, direct_samples=2)


def frames(
    gpu: Any, name: str, size: tuple[int, int] = SIZE, **changes: object
) -> tuple[Any, lab.Frame, Any, lab.Frame]:
    """A Vulkan engine and its frame, the CPU's and its."""
    vulkan, cpu = engines(gpu, name)
    params = SETTINGS.replace(**changes)
    a, b = (lab.render(cpu.scene, params, size=size, engine=engine, counts=False) for engine in (vulkan, cpu))
    return vulkan, a, cpu, b


def traced(rays: Rays) -> Any:
    with rays.engine.gpu.stage("traced") as encoder:
        found = rays.record(encoder)
    return found.numpy()[rays.directions.numpy()[:, :3].any(axis=1)]


@pytest.mark.parametrize("estimator", ["ratio", "average"])
def test_the_rays_are_those_of_the_frame(gpu: Any, estimator: str) -> None:
    """As many as Embree is given for the same frame, and they find what the frame found."""
    vulkan, frame, cpu, other = frames(gpu, "gallery", shadow_estimator=estimator)
    for stage, collect in (("render_gbuffer", gbuffer_rays), ("trace_shadow_rays", shadow_rays)):
        rays = collect(vulkan, frame)
        assert len(rays) == pytest.approx(cpu.embree_alone(stage, other)[0], rel=3e-3), stage
        assert rays.seconds() > 0
    seen = traced(gbuffer_rays(vulkan, frame)) != 0xFFFFFFFF
    np.testing.assert_array_equal(seen.reshape(SIZE[::-1]), frame.gbuffer.depth > 0)
    rays, k = shadow_rays(vulkan, frame), frame.params.shadow_samples
    there = frame.lighting.light >= 0
    if estimator == "ratio":
        there &= frame.shadows.omega > 0
    # All first samples, then all second ones.
    samples = [frame.shadows.visible[..., s][there[..., s]] for s in range(k)]
    np.testing.assert_array_equal(traced(rays)[: there.sum()], np.concatenate(samples))


def test_light_paths_leave_a_light_wherever_a_ray_arrives(gpu: Any) -> None:
    vulkan, frame, *_ = frames(gpu, "cornell")
    rays = vpl_rays(vulkan, frame)
    arrived = int((traced(rays) != 0xFFFFFFFF).sum())
    # The last path may leave more lights than are wanted.
    assert len(frame.lights) <= arrived < len(frame.lights) + frame.params.max_bounces
    assert frame.lights.paths_launched <= len(rays) <= frame.lights.paths_launched * frame.params.max_bounces
    assert rays.seconds() > 0


def test_lights_of_a_list_come_from_no_rays(gpu: Any) -> None:
    vulkan, frame, *_ = frames(gpu, "lamps", interleave=4)
    rays = vpl_rays(vulkan, frame)
    assert len(rays) == 0 and rays.seconds() == 0


@pytest.mark.parametrize("changes", [{}, {"interleave": 2}, {"first_level": 1, "lobe": "mean", "receiver": "soft"}])
def test_perfect_lists_send_what_they_hold(gpu: Any, changes: dict[str, Any]) -> None:
    """Every light of a list adds light to every pixel of its tile, and no list adds more than all lights do."""
    vulkan, frame, *_ = frames(gpu, "cornell", (96, 96), shadow_samples=0, **changes)
    limit = LightLimit(vulkan, frame, tiles=1000, groups=50)
    assert limit.rate() > 0
    n = frame.params.interleave
    found = limit.irradiance()
    lane = np.arange(64)
    rows = ((limit.tiles[:, 1, None] * 8 + lane // 8) * n + limit.tiles[:, 2, None] // n).astype(int)
    columns = ((limit.tiles[:, 0, None] * 8 + lane % 8) * n + limit.tiles[:, 2, None] % n).astype(int)
    whole = frame.lighting.irradiance[rows, columns]
    assert len(limit.tiles) >= 4 and (found > 0).any(axis=2).all()
    assert (found <= whole * 1.0001 + 1e-6).all()
    assert found.sum() > 0.4 * whole.sum(), "lists hold much of what pixels get"
    used = vulkan.light(frame.hierarchy, frame.gbuffer, frame.params, True).lights_used.sum(axis=0)[rows, columns]
    lengths = limit._values["length"].numpy()
    assert (lengths[:, None] <= used).all() and limit.pairs % (64 * lengths.sum()) == 0


def test_a_picture_without_a_whole_tile_has_no_rate(gpu: Any) -> None:
    vulkan, _ = engines(gpu, "cornell")
    frame = lab.render(vulkan.scene, SETTINGS, size=(7, 7), engine=vulkan, counts=False)
    limit = LightLimit(vulkan, frame, tiles=8, groups=8)
    assert limit.pairs == 0 and limit.rate() == 0


def test_every_picker_and_number_of_picks_runs(gpu: Any) -> None:
    vulkan, frame, *_ = frames(gpu, "cornell", (96, 96), picker="race", shadow_samples=9)
    assert LightLimit(vulkan, frame, tiles=1000, groups=4).rate() > 0


def test_streaming_reads_every_number(gpu: Any) -> None:
    stream = StreamLimit(gpu, 3 * 2**20 + 5)
    assert stream.bytes == 3 * 2**20
    assert 1e6 < stream.rate(2) < 1e14
    assert stream.read_back() == stream.bytes // 4


def test_a_device_that_reads_too_little_is_told(gpu: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StreamLimit, "read_back", lambda _: 16)
    with pytest.raises(RuntimeError, match="has read 64"):
        StreamLimit(gpu, 2**20)
