"""The two references as functions."""

from __future__ import annotations

from lab.engine.cpu import CpuEngine
from lab.params import Params
from lab.records import Lights
from lab.reference.brute_force import BruteForce
from lab.reference.estimate import Budget, Progress, Reference, refine
from lab.reference.path_tracer import PathTracer
from lab.scene.scene import Camera


def path_traced(
    engine: CpuEngine,
    camera: Camera,
    size: tuple[int, int],
    params: Params | None = None,
    *,
    budget: Budget | None = None,
    pixel: str = "centre",
    progress: Progress | None = None,
) -> Reference:
    """The view as a diffuse path tracer sees it, with no virtual lights in between.

    Args:
        engine: the scene.
        camera: the view.
        size: (width, height).
        params: ``max_bounces`` and ``seed`` count. Light that has bounced 1..max_bounces times is indirect.
        budget: how long to refine (default: 256 paths a pixel).
        pixel: ``centre``: every path starts where the frame's own ray meets the surface, with the same filtered
            texture; for judging frames. ``area``: evenly over the pixel, full-resolution textures; what other renderers
            with a box filter give.
        progress: see :data:`lab.reference.estimate.Progress`.
    """
    return refine(PathTracer(engine, camera, size, params or Params(), pixel), budget or Budget(), progress)


def brute_force(
    engine: CpuEngine,
    camera: Camera,
    size: tuple[int, int],
    params: Params | None = None,
    *,
    lights: Lights | None = None,
    budget: Budget | None = None,
    progress: Progress | None = None,
) -> Reference:
    """The view lit by every virtual light, each with its shadow ray: what the hierarchy approximates.

    Args:
        engine: the scene.
        camera: the view.
        size: (width, height).
        params: ``vpls``, ``max_bounces``, ``falloff``, ``clamp_distance``, ``compensation`` and ``seed`` count.
        lights: these in place of the VPLs of `params` or the scene's list.
        budget: how long to refine (default: 1024 lights drawn a pixel; where fewer light it, the sum is exact).
        progress: see :data:`lab.reference.estimate.Progress`.
    """
    return refine(BruteForce(engine, camera, size, params or Params(), lights), budget or Budget(), progress)
