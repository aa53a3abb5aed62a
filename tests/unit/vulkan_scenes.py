"""What the Vulkan stages' tests look at: engines of both kinds over one scene, and how far two planes differ."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.engine.cpu import CpuEngine
from lab.scene.load import load_scene
from lab.scene.scene import Camera, Material, Mesh, PointLight, Scene, SpotLight, SunLight

from ..oracle_geometry.scenes import box, quad, scene_of, soup

ROOT = Path(__file__).resolve().parents[2]


@cache
def cpu_engine(name: str) -> CpuEngine:
    """The CPU engine over the scene called `name`: one of ``scenes/``, or ``gallery``."""
    return CpuEngine(gallery() if name == "gallery" else load_scene(ROOT / "scenes" / name / "scene.toml"))


@cache
def _vulkan_engine(gpu: Any, name: str) -> Any:
    from lab.engine.vulkan.engine import VulkanEngine

    return VulkanEngine(cpu_engine(name).scene, gpu)


def engines(gpu: Any, name: str) -> tuple[Any, CpuEngine]:
    """The Vulkan and the CPU engine over one scene."""
    return _vulkan_engine(gpu, name), cpu_engine(name)


def gallery() -> Scene:
    """One of each: lights of all kinds, textures of odd sizes, holes, smooth and coloured meshes."""
    rng = np.random.default_rng(4)
    lace = np.full((6, 5, 4), 255, np.uint8)
    lace[..., :3] = rng.integers(0, 256, (6, 5, 3))
    lace[::2, 1::2, 3] = 0
    picture = rng.integers(0, 256, (64, 48, 4), dtype=np.uint8)
    picture[..., 3] = 255
    materials = [
        Material("walls", (0.7, 0.6, 0.5)),
        Material("picture", (0.9, 1.0, 0.8), texture=0),
        Material("lace", texture=1, alpha_cutoff=0.5),
        Material("lamp", (0.1, 0.1, 0.1), emission=(5.0, 4.0, 3.0)),
        Material("panel", (0.2, 0.2, 0.2), emission=(0.0, 0.5, 7.0), two_sided=True),
        Material("gone", alpha=0.2, alpha_cutoff=0.5),
    ]
    floor = quad((-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2), 1, uv=True)
    floor = dataclasses.replace(floor, uv=floor.uv * np.float32([3, -2]) + np.float32([0.3, 7.1]))  # type: ignore[operator]
    rough = soup(9, 30, size=0.2, scale=0.6, shift=0.7)
    normal = rng.normal(size=rough.position.shape)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    colour = rng.uniform(0, 1, rough.position.shape)
    rough = dataclasses.replace(rough, normal=normal.astype(np.float32), colour=colour.astype(np.float32))
    meshes: list[Mesh] = [
        box((-2, -0.01, -2), (2, 2.5, 2), 0, inward=True),
        floor,
        rough,
        quad((-1.5, 0.1, 0.8), (1.0, 0.1, 0.8), (1.0, 1.8, 0.8), (-1.5, 1.8, 0.8), 2, uv=True),
        quad((-0.5, 2.4, -0.5), (0.5, 2.4, -0.5), (0.5, 2.4, 0.5), (-0.5, 2.4, 0.5), 3),
        quad((1.5, 0.5, -1.0), (1.5, 0.5, -0.5), (1.5, 1.5, -0.5), (1.5, 1.5, -1.0), 4),
        quad((-2, 0, 1.5), (2, 0, 1.5), (2, 2, 1.5), (-2, 2, 1.5), 5),
    ]
    lights: dict[str, Any] = {
        "suns": [SunLight((0.1, 0.2, 1.0), (2.0, 1.8, 1.5))],
        "points": [PointLight((-1.0, 1.5, 0.5), (1.0, 0.2, 0.1)), PointLight((30.0, 40.0, 20.0), (500.0,) * 3)],
        "spots": [
            SpotLight((1.0, 2.0, 0.0), (-0.4, -1.0, -0.1), (3.0, 3.0, 1.0), 0.2, 0.7),
            SpotLight((0.0, 20.0, 0.0), (0.0, -1.0, 0.1), (90.0, 10.0, 10.0), 0.3, 1.2),
        ],
    }
    scene = scene_of(meshes, materials, textures=[picture, lace], **lights)
    return dataclasses.replace(scene, cameras=[Camera("c", (1.3, 1.3, 1.4), (-0.4, 0.6, -0.4), fov_y_deg=80.0)])


def apart(found: NDArray[Any], wanted: NDArray[Any], tolerance: float) -> NDArray[np.bool_]:
    """Which rows (pixels, lights, samples) of two planes with numbers along the last axis differ."""
    assert found.shape == wanted.shape and found.dtype == wanted.dtype
    far: NDArray[np.bool_] = (np.abs(found.astype(np.float64) - wanted) > tolerance).any(axis=-1)
    return far
