"""Stage trace_vpls on the device: the core's paths, light by light."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from lab.engine.vulkan.engine import VulkanEngine
from lab.engine.vulkan.lights import lights_parts
from lab.engine.vulkan.records import parts
from lab.errors import LabError
from lab.params import Params
from lab.records import Lights
from lab.scene.scene import PointLight

from .vulkan_scenes import apart, cpu_engine, engines


def matches(found: Lights, wanted: Lights, radius: float) -> Any:
    """(m, 2) rows of `found` and of `wanted` that are one light but for rounding, in the order of `found`."""
    near, partner = cKDTree(wanted.position).query(found.position)
    close = near < 1e-6 * radius
    for name, tolerance in (("normal", 1e-5), ("flux", 1e-5 * float(wanted.flux.max()))):
        close &= ~apart(getattr(found, name), getattr(wanted, name)[partner], tolerance)
    rows = np.flatnonzero(close)
    return np.stack([rows, partner[rows]], axis=1)


@pytest.mark.parametrize("settings", [{}, {"seed": 7, "max_bounces": 5}, {"max_bounces": 1}], ids=str)
@pytest.mark.parametrize("name", ["atrium", "gallery", "cornell"])
def test_the_lights_are_the_cores(gpu: Any, name: str, settings: dict[str, Any]) -> None:
    """Both compute a hit's place alike; only where two surfaces meet may they find different ones."""
    vulkan, cpu = engines(gpu, name)
    params = Params(vpls=3000, **settings)
    found, wanted = vulkan.trace_vpls(params), cpu.trace_vpls(params)
    assert len(found) == params.vpls
    parted = 1e-3
    assert abs(found.paths_launched - wanted.paths_launched) <= 1 + parted * wanted.paths_launched / 2
    same = matches(found, wanted, cpu.scene_radius)
    assert len(same) >= (1 - parted) * params.vpls
    assert (np.diff(same[:, 1]) > 0).mean() > 1 - parted, "the same order"
    assert np.abs(same[:, 0] - same[:, 1]).max() <= 3 + parted * params.vpls / 2
    np.testing.assert_allclose(found.flux.sum(axis=0), wanted.flux.sum(axis=0), rtol=1e-3)


def test_once_the_scene_is_known_the_lights_are_the_same(gpu: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first call looks for the number of paths; the others launch enough, for any seed, and read nothing back."""
    vulkan = VulkanEngine(cpu_engine("gallery").scene, gpu)
    params = [Params(vpls=vpls, seed=seed) for vpls, seed in ((777, 5), (40, 6), (5000, 7))]
    first = [VulkanEngine(vulkan.scene, gpu).trace_vpls(settings) for settings in params]
    vulkan.trace_vpls(Params(vpls=500))
    with monkeypatch.context() as closed:
        closed.setattr(gpu.pool, "download", None)
        again = [vulkan.trace_vpls(settings) for settings in params]
    for one, two in zip(first, again, strict=True):
        for name in ("position", "flux", "normal", "paths_launched"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        assert parts(one) is not parts(two) and lights_parts(gpu, one) is parts(one)


def test_too_few_paths_are_told(gpu: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from lab.engine.vulkan import trace_vpls

    vulkan = VulkanEngine(cpu_engine("gallery").scene, gpu)
    vulkan.trace_vpls(Params(vpls=500))
    monkeypatch.setattr(trace_vpls, "_enough_paths", lambda *_: 20)
    lights = vulkan.trace_vpls(Params(vpls=500))
    with pytest.raises(RuntimeError, match="fewer than 500 lights"):
        _ = lights.paths_launched
    assert not lights.flux.any()


def test_more_paths_than_one_round_takes_are_put_in_order(gpu: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from lab.engine.vulkan import trace_vpls

    params = Params(vpls=3000)
    whole = engines(gpu, "cornell")[0].trace_vpls(params)
    monkeypatch.setattr(trace_vpls, "_MOST_ROWS", 3 * 256)
    engine = VulkanEngine(cpu_engine("cornell").scene, gpu)
    for _ in range(2):  # while the number of paths is looked for, and once it is known
        rounds = engine.trace_vpls(params)
        np.testing.assert_array_equal(rounds.position, whole.position)
        np.testing.assert_array_equal(rounds.flux, whole.flux)
        assert rounds.paths_launched == whole.paths_launched


def test_a_list_of_lights_is_the_scenes_own(gpu: Any) -> None:
    lights = Lights(np.zeros((1, 3)), np.ones((1, 3)))
    scene = dataclasses.replace(cpu_engine("cornell").scene, light_list=lights)
    assert VulkanEngine(scene, gpu).trace_vpls(Params()) is lights


@pytest.mark.parametrize("lamp", [None, PointLight((0.0, 1.0, 0.0), (0.0, 0.0, 0.0))])
def test_a_scene_without_light_says_so(gpu: Any, lamp: PointLight | None) -> None:
    scene = cpu_engine("cornell").scene
    dark = [dataclasses.replace(material, emission=(0.0, 0.0, 0.0)) for material in scene.materials]
    scene = dataclasses.replace(scene, materials=dark, points=[lamp] if lamp else [])
    with pytest.raises(LabError, match=r"no light with any power.*Turn a light toward the scene"):
        VulkanEngine(scene, gpu).trace_vpls(Params(vpls=10))


def test_light_that_reaches_nothing_says_so(gpu: Any) -> None:
    scene = cpu_engine("cornell").scene
    black = [dataclasses.replace(material, base_colour=(0.0, 0.0, 0.0)) for material in scene.materials]
    with pytest.raises(LabError, match=r"none of .* rays from the lights reached a surface that reflects"):
        VulkanEngine(dataclasses.replace(scene, materials=black), gpu).trace_vpls(Params(vpls=10))
