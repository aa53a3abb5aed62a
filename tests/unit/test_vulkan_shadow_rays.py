"""Stage trace_shadow_rays on the device: the core's members, weights and rays, from the same picks."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine, build_members
from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.records import parts
from lab.engine.vulkan.shadows import shadow_parts
from lab.errors import LabError
from lab.params import Params
from lab.records import Lights, ShadowSamples
from lab.scene.scene import PointLight

from .vulkan_scenes import apart, cpu_engine, engines

SIZE = (64, 36)
VARIANTS: dict[str, dict[str, Any]] = {
    "ours": {},
    "one candidate, no cap": {"member_candidates": 1, "omega_max": "none", "shadow_samples": 7},
    "scatter": {"construction": "scatter", "first_shadow_level": 2},
    "half open": {"gather_range": "half_open", "first_shadow_level": 2},
    "soft": {"receiver": "soft", "lobe": "mean_energy"},
    "corrected": {"shadow_estimator": "corrected", "omega_max": 2.0, "lobe": "mean"},
    "average": {"shadow_estimator": "average"},
    "rgb": {"shadow_estimator": "ratio_rgb", "interleave": 2, "alpha": 2.0},
    "rgb, soft": {"shadow_estimator": "ratio_rgb", "receiver": "soft", "falloff": "softened", "importance": False},
    "jitter": {"shadow_points": "jitter", "deviation_scale": 1.0},
    "another frame": {"frame": 9, "seed": 4, "direct_samples": 2},
    "no samples": {"shadow_samples": 0, "direct_samples": 0},
}


@cache
def inputs(name: str, variant: str) -> tuple[Any, ...]:
    """The core's records up to the stage, its settings, and what the core makes of them."""
    cpu = cpu_engine(name)
    params = Params(vpls=1500, **VARIANTS[variant])
    hierarchy = cpu.build_hierarchy(cpu.trace_vpls(params), params)
    gbuffer = cpu.render_gbuffer(cpu.scene.cameras[0], SIZE)
    lighting = cpu.light(hierarchy, gbuffer, params, counts=False)
    return hierarchy, gbuffer, lighting, params


def both(gpu: Any, name: str, variant: str) -> tuple[ShadowSamples, ShadowSamples]:
    vulkan, cpu = engines(gpu, name)
    records = inputs(name, variant)
    return vulkan.trace_shadow_rays(*records), cpu.trace_shadow_rays(*records)


CASES = [("gallery", variant) for variant in VARIANTS] + [("cornell", "ours"), ("atrium", "ours")]


@pytest.mark.parametrize(("name", "variant"), CASES)
def test_the_samples_are_the_cores(gpu: Any, name: str, variant: str) -> None:
    found, wanted = both(gpu, name, variant)
    radius = cpu_engine(name).scene_radius
    rare = 2e-3  # decisions that fall within rounding
    assert np.mean(found.member != wanted.member, dtype=float) <= rare if wanted.member.size else True
    same = found.member == wanted.member
    assert not apart(found.point, wanted.point, 1e-5 * radius)[same].any()
    # Near a grid light's horizon omega is the quotient of two small numbers.
    omega = np.isclose(found.omega, wanted.omega, rtol=2e-3, atol=1e-4)
    assert (~omega & same).sum() <= rare * omega.size
    assert ((found.visible != wanted.visible) & same).sum() <= rare * same.size
    assert found.visible.dtype == np.uint8 and found.member.dtype == np.int32


@pytest.mark.parametrize(("name", "variant"), CASES)
def test_sums_and_direct_light_are_the_cores(gpu: Any, name: str, variant: str) -> None:
    found, wanted = both(gpu, name, variant)
    for plane in ("shadowed", "weight", "direct", "area"):
        ours, cores = getattr(found, plane), getattr(wanted, plane)
        scale = max(1e-6, float(np.abs(cores).max()))
        assert apart(ours, cores, 1e-3 * scale).mean() < 5e-3, plane
        np.testing.assert_allclose(ours.mean(dtype=float), cores.mean(dtype=float), rtol=2e-3, err_msg=plane)
    assert found.left_out is None


@pytest.mark.parametrize("falloff", ["clamped", "softened"])
def test_short_paths_are_the_cores(gpu: Any, falloff: str) -> None:
    vulkan, cpu = engines(gpu, "gallery")
    *records, params = inputs("gallery", "ours")
    params = params.replace(compensation="path", falloff=falloff, clamp_distance=0.2, frame=3)
    found = vulkan.trace_shadow_rays(*records, params).left_out
    wanted = cpu.trace_shadow_rays(*records, params).left_out
    assert wanted is not None and (wanted > 0).mean() > 0.1
    # A path that parts from the core's changes its pixel.
    assert apart(found, wanted, 2e-3 * float(wanted.max())).mean() < 1e-2
    np.testing.assert_allclose(found.mean(dtype=float), wanted.mean(dtype=float), rtol=1e-2)
    lit_by_list = VulkanEngine(
        dataclasses.replace(cpu.scene, light_list=Lights(np.zeros((1, 3)), np.ones((1, 3)))), gpu
    )
    with pytest.raises(LabError, match="compensation=path: test is lit by a list of point lights"):
        lit_by_list.trace_shadow_rays(*records, params)


def test_among_many_lamps_short_paths_choose_as_the_core_does(gpu: Any) -> None:
    """More than are all looked at: a few are drawn by power, and one of these is taken."""
    rng = np.random.default_rng(2)
    places, powers = rng.uniform((-1.8, 0.1, -1.8), (1.8, 2.3, 1.8), (40, 3)), rng.gamma(1.0, 1.0, 40)
    lamps = [
        PointLight((float(x), float(y), float(z)), (float(power), 0.5, 0.1))
        for (x, y, z), power in zip(places, powers, strict=True)
    ]
    scene = dataclasses.replace(cpu_engine("gallery").scene, points=lamps)
    *records, params = inputs("gallery", "ours")
    params = params.replace(compensation="path", clamp_distance=0.2)
    found = VulkanEngine(scene, gpu).trace_shadow_rays(*records, params).left_out
    wanted = CpuEngine(scene).trace_shadow_rays(*records, params).left_out
    assert found is not None and wanted is not None
    assert apart(found, wanted, 2e-3 * float(wanted.max())).mean() < 1e-2
    np.testing.assert_allclose(found.mean(dtype=float), wanted.mean(dtype=float), rtol=1e-2)


def test_the_scenes_show_what_is_tested(gpu: Any) -> None:
    found, _ = both(gpu, "gallery", "ours")
    assert 0.1 < found.visible.mean() < 0.95
    assert (found.direct > 0).any() and (found.area > 0).any()
    hierarchy, _, lighting, _ = inputs("gallery", "ours")
    assert (lighting.light >= hierarchy.offset[2]).any()


def test_a_hierarchy_of_the_device_gives_the_same_members(gpu: Any) -> None:
    """From lists that the device made, the core's draws from lists that it made of the same levels."""
    vulkan, cpu = engines(gpu, "gallery")
    _, gbuffer, _, params = inputs("gallery", "ours")
    hierarchy = vulkan.build_hierarchy(cpu.trace_vpls(params), params)
    lighting = vulkan.light(hierarchy, gbuffer, params, counts=False)
    found = vulkan.trace_shadow_rays(hierarchy, gbuffer, lighting, params)
    listed = dataclasses.replace(hierarchy, members=build_members(hierarchy, params))
    wanted = cpu.trace_shadow_rays(listed, gbuffer, lighting, params)
    assert (found.member[lighting.light >= 0] >= 0).all()
    assert np.mean(found.member != wanted.member) < 2e-3


def test_what_it_does_not_do_it_says(gpu: Any) -> None:
    vulkan, _ = engines(gpu, "gallery")
    hierarchy, gbuffer, lighting, params = inputs("gallery", "ours")
    with pytest.raises(LabError, match="shadow_samples=2: the lighting was made with 4"):
        vulkan.trace_shadow_rays(hierarchy, gbuffer, lighting, params.replace(shadow_samples=2))
    bare = dataclasses.replace(hierarchy, members=None)
    with pytest.raises(LabError, match="no member lists: build it with shadow_points=members"):
        vulkan.trace_shadow_rays(bare, gbuffer, lighting, params)


def test_the_record_stays_on_the_device(gpu: Any) -> None:
    found, _ = both(gpu, "gallery", "ours")
    assert shadow_parts(gpu, found) is parts(found)
