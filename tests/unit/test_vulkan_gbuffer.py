"""Stage render_gbuffer on the device is the core's, but for pixels whose ray passes an edge within rounding."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.engine.vulkan.gbuffer import gbuffer_parts
from lab.engine.vulkan.records import parts
from lab.engine.vulkan.scene_textures import mip_chain
from lab.records import GBuffer
from lab.scene.load import load_scene
from lab.scene.scene import Camera

from .vulkan_scenes import apart, engines

SIZE = (160, 90)
TOLERANCE = {"position": 2e-5, "normal": 3e-4, "geometric_normal": 1e-6, "albedo": 3e-4, "emission": 1e-6}
"""Of planes; positions relative to R."""


def ties(found: GBuffer, wanted: GBuffer, radius: float) -> Any:
    """Pixels that differ beyond rounding, in any plane."""
    scale = {"position": radius}
    differ = apart(found.depth[..., None], wanted.depth[..., None], 2e-5 * radius)
    for name, tolerance in TOLERANCE.items():
        differ |= apart(getattr(found, name), getattr(wanted, name), tolerance * scale.get(name, 1.0))
    return differ


@pytest.mark.parametrize("name", ["atrium", "gallery", "cornell"])
def test_the_planes_are_the_cores(gpu: Any, name: str) -> None:
    vulkan, cpu = engines(gpu, name)
    assert vulkan.scene_radius == pytest.approx(cpu.scene_radius, rel=1e-6)
    for camera in vulkan.scene.cameras:
        found, wanted = vulkan.render_gbuffer(camera, SIZE), cpu.render_gbuffer(camera, SIZE)
        assert found.pixel_angle == pytest.approx(wanted.pixel_angle, rel=1e-6)
        assert ties(found, wanted, cpu.scene_radius).mean() < 1e-3, camera.name
        assert (found.depth > 0).mean() > 0.5


def test_the_planes_of_a_textured_scene_with_masks_are_the_cores(gpu: Any, shared_scenes: Path) -> None:
    from lab.engine.vulkan.engine import VulkanEngine

    scene = load_scene(shared_scenes / "sponza.glb")
    vulkan, cpu = VulkanEngine(scene, gpu), CpuEngine(scene)
    found, wanted = (engine.render_gbuffer(scene.cameras[0], SIZE) for engine in (vulkan, cpu))
    assert ties(found, wanted, cpu.scene_radius).mean() < 1e-3


def test_holes_are_seen_through(gpu: Any) -> None:
    """Behind the lace is the far wall, and of the mesh that is all hole nothing is seen."""
    vulkan, _ = engines(gpu, "gallery")
    z = vulkan.render_gbuffer(Camera("c", (0.0, 1.0, 1.9), (0.0, 1.0, 0.0)), SIZE).position[..., 2]
    assert not np.isclose(z, 1.5).any()
    assert 0.05 < np.isclose(z, 0.8, atol=1e-4).mean() < 0.9 and (z < 0.5).mean() > 0.05


def test_where_nothing_is_hit_all_is_zero(gpu: Any) -> None:
    vulkan, _ = engines(gpu, "cornell")
    away = Camera("away", (0.0, 100.0, 0.0), (0.0, 200.0, 1.0))
    g = vulkan.render_gbuffer(away, (7, 5))
    assert g.size == (7, 5)
    for name in (*TOLERANCE, "depth"):
        assert not getattr(g, name).any(), name


def test_the_record_stays_on_the_device(gpu: Any) -> None:
    vulkan, _ = engines(gpu, "cornell")
    g = vulkan.render_gbuffer(vulkan.scene.cameras[0], (16, 9))
    assert gbuffer_parts(gpu, g) is parts(g)
    assert vulkan.stages_ms()["render_gbuffer"] > 0


def test_a_texture_halves_down_to_one_texel_in_linear_light() -> None:
    image = np.zeros((5, 2, 4), np.uint8)
    image[:, 0] = 255
    chain = mip_chain(image)
    assert [level.shape[:2] for level in chain] == [(5, 2), (2, 1), (1, 1)]
    # Half of the light is 188 in sRGB, half of an opacity 128.
    np.testing.assert_array_equal(chain[-1][0, 0], [188, 188, 188, 128])
