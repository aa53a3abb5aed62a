"""The probe of a pixel: every grid light that lights it, term by term, its picks and its shadow."""

from __future__ import annotations

from typing import Any

import numpy as np

from lab import _core
from lab.engine.cpu import CpuEngine
from lab.engine.engine import Engine, create_engine
from lab.errors import LabError
from lab.library import render
from lab.params import Params
from lab.pixel.records import Doubles, PixelShadow, PixelValues, Probe, ProbedLights, ProbedPicks
from lab.records import Frame, Hierarchy
from lab.scene.scene import Camera, Scene


def probe(
    scene: Scene,
    params: Params | None = None,
    x: int = 0,
    y: int = 0,
    *,
    camera: str | Camera = "",
    size: tuple[int, int] = (1280, 720),
    engine: str | Engine = "cpu",
) -> Probe:
    """Renders `scene` and probes pixel (x, y), counted from the upper left.

    Args:
        scene: from :func:`lab.load_scene`, or made in Python.
        params: the settings; defaults to ``Params()``.
        x: column of the pixel, from the left.
        y: row of the pixel, from the top.
        camera: as of :func:`lab.render`.
        size: (width, height) of the frame in pixels.
        engine: ``cpu``, or one that is kept.

    Errors: :class:`lab.LabError` for a pixel outside of the image, and those of :func:`lab.render`.
    """
    x, y = pixel_of(size, x, y)
    ready = create_engine(engine, scene) if isinstance(engine, str) else engine
    if not isinstance(ready, CpuEngine):
        raise LabError(f"probe: expected the engine cpu, got {type(ready).__name__}")
    return probe_pixel(ready, render(scene, params, camera=camera, size=size, engine=ready), x, y)


def probe_pixel(engine: CpuEngine, frame: Frame, x: int, y: int) -> Probe:
    """Pixel (x, y) of a `frame` that `engine` has rendered; the frame need not have counted its lights.

    Every light is evaluated anew, one after the other: sums and counts are those of the frame but for rounding.
    """
    x, y = pixel_of(frame.gbuffer.size, x, y)
    g, params, hierarchy = frame.gbuffer, frame.params, frame.hierarchy
    found = reaching_lights(engine, frame, x, y)
    lit = found["bright"] > 0
    lights = _lights(hierarchy, {name: found[name][lit] for name in _COLUMNS}, int(found["first_pick"]), params)
    n = params.interleave
    chosen = lights.probability > 0
    return Probe(
        x=x,
        y=y,
        tile=(x % n, y % n),
        point=g.position[y, x].copy(),
        normal=g.normal[y, x].copy(),
        geometric_normal=g.geometric_normal[y, x].copy(),
        albedo=g.albedo[y, x].copy(),
        depth=float(g.depth[y, x]),
        params=params,
        lights=lights,
        irradiance=lights.contribution.sum(axis=0, dtype=np.float64),
        weight_sum=float(lights.target_weight[chosen].sum(dtype=np.float64)),
        overdraw=found["overdraw"],
        lights_used=found["lights_used"],
        picks=_picks(frame, lights, x, y),
        shadow=_shadow(frame, x, y),
        image=PixelValues(
            *(getattr(frame.image, name)[y, x].copy() for name in ("colour", "direct", "indirect", "unshadowed"))
        ),
    )


_COLUMNS = (
    "index", "level", "distance", "blend_weight", "receiver_cosine", "emission", "falloff", "scale", "contribution",
    "bright",
)  # fmt: skip


def pixel_of(size: tuple[int, int], x: int, y: int) -> tuple[int, int]:
    """(x, y) as whole numbers inside an image of `size` = (width, height), or a :class:`LabError`."""
    width, height = size
    whole = float(x).is_integer() and float(y).is_integer()
    if not whole or not (0 <= x < width and 0 <= y < height):
        raise LabError(
            f"pixel {x},{y}: lies outside of the image of {width}x{height}; x goes from 0 to {width - 1}, "
            f"y from 0 (top) to {height - 1}"
        )
    return int(x), int(y)


def reaching_lights(engine: CpuEngine, frame: Frame, x: int, y: int) -> dict[str, Any]:
    """Every grid light of the pixel's tile with a blend weight above 0, as the core's columns."""
    g, params = frame.gbuffer, frame.params
    n = params.interleave
    radius, settings = engine.scene_radius, params.to_core()
    tile = (y % n) * n + x % n
    found = _core.probe_pixel(frame.hierarchy, g.position[y, x], g.normal[y, x], tile, settings, radius)
    if g.depth[y, x] > 0:
        return found
    # A pixel that sees no surface stands nowhere.
    empty = {name: found[name][:0] for name in _COLUMNS}
    counts = {name: np.zeros_like(found[name]) for name in ("overdraw", "lights_used")}
    return found | empty | counts


def _lights(hierarchy: Hierarchy, columns: dict[str, Any], first_pick: int, params: Params) -> ProbedLights:
    index = columns["index"].astype(np.int64)
    bright = columns.pop("bright")
    total = float(bright.sum(dtype=np.float64))
    # LY19 3.3: f is what a light sends unshadowed, or 1; where no light of the chosen levels sends any, all count.
    target = bright if params.importance else np.ones_like(bright)
    chosen = np.where(index >= first_pick, target, 0).astype(np.float64)
    if not chosen.any():
        chosen = target.astype(np.float64)
    return ProbedLights(
        **columns | {"index": index},
        share=bright.astype(np.float64) / max(total, np.finfo(np.float64).tiny),
        target_weight=target,
        probability=chosen / chosen.sum() if len(chosen) else chosen,
        position=hierarchy.position[index],
        flux=hierarchy.flux[index],
    )


def _picks(frame: Frame, lights: ProbedLights, x: int, y: int) -> ProbedPicks:
    light, shadows = frame.lighting.light[y, x], frame.shadows
    omega = shadows.omega[y, x]
    picked = light >= 0
    level = np.searchsorted(frame.hierarchy.offset, light, side="right") - 1
    row = np.searchsorted(lights.index, light)
    found = picked & (np.append(lights.index, -2)[row] == light)
    all_traced = frame.params.shadow_estimator == "average"
    return ProbedPicks(
        light=light.copy(),
        level=np.where(picked, level, -1).astype(np.int32),
        target_weight=frame.lighting.target_weight[y, x].copy(),
        probability=np.where(found, np.append(lights.probability, 0.0)[row], 0.0),
        point=shadows.point[y, x].copy(),
        member=shadows.member[y, x].copy(),
        omega=omega.copy(),
        traced=picked & (all_traced | (omega > 0)),
        visible=shadows.visible[y, x] > 0,
    )


def _shadow(frame: Frame, x: int, y: int) -> PixelShadow:
    s, u, fs, fu = (
        np.asarray(plane[y, x], np.float64)
        for plane in (frame.shadows.shadowed, frame.shadows.weight, frame.filtered.shadowed, frame.filtered.weight)
    )
    ratio = frame.image.shadow_ratio[y, x].astype(np.float64)
    return PixelShadow(s, u, ratio_of(s, u), fs, fu, ratio_of(fs, fu), ratio)


def ratio_of(shadowed: Doubles, weight: Doubles) -> Doubles:
    """S / U; NaN where U is 0."""
    return np.divide(shadowed, weight, out=np.full_like(weight, np.nan), where=weight > 0)
