"""The method as a library: render a scene, or use the hierarchy alone in a renderer of your own."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from lab.engine.engine import Engine, create_engine
from lab.engine.memory import check_memory
from lab.errors import LabError
from lab.frame import Progress, render_frame
from lab.params import Params
from lab.records import Floats, Frame, GBuffer, Hierarchy, as_rows
from lab.scene.scene import Camera, Scene


def render(
    scene: Scene,
    params: Params | None = None,
    *,
    camera: str | Camera = "",
    size: tuple[int, int] = (1280, 720),
    engine: str | Engine = "cpu",
    device: str = "",
    progress: Progress | None = None,
    counts: bool = True,
) -> Frame:
    """Renders one frame of `scene`.

    Args:
        scene: from :func:`lab.load_scene`, or made in Python.
        params: the settings; defaults to ``Params()``.
        camera: one of the scene's by name (empty: the first), or a :class:`Camera`.
        size: (width, height) in pixels.
        engine: an engine's name, or one that is kept to render the same scene again.
        device: for engine ``vulkan``, which Vulkan device, by name or number; empty for the first.
        progress: called with each stage's name as it begins.
        counts: whether to count the lights of every pixel, ``frame.lighting.overdraw`` and ``lights_used``.

    Errors: :class:`lab.LabError` for an unknown camera or engine, and where lights reach no surface.
    """
    if len(size) != 2 or any(int(side) != side or side < 1 for side in size):
        raise LabError(f"size: expected (width, height) in whole pixels, at least one each, got {size}")
    chosen = scene.camera(camera) if isinstance(camera, str) else camera
    params = params or Params()
    lights = params.vpls if scene.light_list is None else len(scene.light_list)
    check_memory(lights, size, params)
    ready = create_engine(engine, scene, device=device) if isinstance(engine, str) else engine
    return render_frame(ready, chosen, (int(size[0]), int(size[1])), params, progress, counts=counts)


def irradiance(
    hierarchy: Hierarchy,
    positions: ArrayLike,
    normals: ArrayLike,
    params: Params | None = None,
    *,
    scene_radius: float | None = None,
) -> Floats:
    """Unshadowed irradiance that points receive from the hierarchy (LY19 3.2).

    Args:
        hierarchy: from :func:`lab.build_hierarchy`.
        positions: (n, 3) points.
        normals: (n, 3) unit normals of one-sided receivers.
        params: ``alpha``, ``first_level``, ``lobe``, ``receiver``, ``falloff`` and ``clamp_distance`` count.
        scene_radius: R that ``clamp_distance`` is a fraction of; default: half of the diagonal of the lights' box.

    Returns:
        (n, 3) irradiance, linear RGB. Points that lie together in the array are lit together: sorting them pays.
    """
    from lab import _core

    position, normal = as_rows("positions", positions, 3), as_rows("normals", normals, 3)
    if len(position) != len(normal):
        raise LabError(f"irradiance: {len(position)} positions and {len(normal)} normals must agree")
    if len(position) == 0:
        return position
    length = np.linalg.norm(normal, axis=1)
    if (np.abs(length - 1) > 1e-3).any():
        row = int(np.argmax(np.abs(length - 1) > 1e-3))
        raise LabError(f"normals: row {row} has length {length[row]:g}, expected 1")
    if scene_radius is None:
        lights = hierarchy.levels[0].position.astype(np.float64)
        scene_radius = float(np.linalg.norm(lights.max(axis=0) - lights.min(axis=0)) / 2)
    zeros = np.zeros_like(position)[None]
    points = GBuffer(
        position=position[None],
        normal=normal[None],
        geometric_normal=normal[None],
        albedo=zeros,
        emission=zeros,
        depth=np.ones((1, len(position)), np.float32),
        pixel_angle=0.0,
    )
    plain = (params or Params()).replace(shadow_samples=0, interleave=1)
    received: Floats = _core.light(hierarchy, points, plain.to_core(), scene_radius, counts=False)["irradiance"][0]
    return received
