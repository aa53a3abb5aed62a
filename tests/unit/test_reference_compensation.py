"""What the clamped falloff leaves out, brought back by short paths: with it, virtual lights sum to the path tracer."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.reference import Budget, brute_force, path_traced
from lab.scene.scene import Camera, Material, PointLight, SunLight

from ..oracle_geometry.scenes import Array, occluded_room, wall_lights
from ..oracle_geometry.statistics import accept, block_means, welch_test
from ..oracle_geometry.two_patches import TwoPatches, cornered, facing

CAMERA = Camera("inside", (1.6, 1.2, 1.8), (-0.3, 0.6, -0.4), fov_y_deg=80.0)
SIZE = (12, 8)
SUN = (3.0, 2.0, 4.0)


# --- one bounce between two patches, by quadrature -------------------------------------------------------------------


def share(d2: Array, falloff: str, clamp: float) -> Array:
    """1 - G d^2."""
    return np.maximum(0, 1 - d2 / clamp**2) if falloff == "clamped" else clamp**2 / (d2 + clamp**2)


def left_out(t: TwoPatches, position: Array, falloff: str, clamp: float, cells: int = 160) -> Array:
    """(p,) irradiance, per radiosity / pi of the lit patch, that `falloff` leaves out at (p, 3) points of the other."""
    u, v = np.stack(np.meshgrid(*[(np.arange(cells) + 0.5) / cells] * 2), axis=-1).reshape(-1, 2).T[..., None]
    edges = t.lit[1] - t.lit[0], t.lit[3] - t.lit[0]
    lit = t.lit[0] + u * edges[0] + v * edges[1]
    normal, seen = np.cross(*edges), np.cross(t.seen[1] - t.seen[0], t.seen[3] - t.seen[0])
    area = np.linalg.norm(normal) / cells**2
    result = []
    for x in position:
        to = lit - x
        d2 = (to**2).sum(axis=1)
        cosines = (to @ seen / np.linalg.norm(seen)) * -(to @ normal / np.linalg.norm(normal)) / d2
        result.append((np.maximum(0, cosines) / d2 * share(d2, falloff, clamp)).sum() * area)
    return np.array(result)


@pytest.mark.parametrize(("falloff", "clamp"), [("clamped", 0.5), ("clamped", 0.9), ("softened", 0.2)])
@pytest.mark.parametrize("name", ["cornered", "facing"])
def test_short_paths_by_quadrature(name: str, falloff: str, clamp: float) -> None:
    t = cornered(0.1) if name == "cornered" else facing(0.75)
    grey = Material("grey", (0.5, 0.5, 0.5))
    engine = CpuEngine(t.scene(grey, grey, suns=[SunLight(t.to_sun, SUN)]))
    g = engine.render_gbuffer(t.camera, SIZE)
    c = clamp if name == "cornered" else 0.75 + 0.5 * clamp  # farther than the patches are apart
    params = Params(falloff=falloff, clamp_distance=c / engine.scene_radius, max_bounces=1)
    runs = [engine.trace_compensation(g, 250 * i, 250, params)["irradiance"][..., 1] / 250 for i in range(24)]
    radiance = SUN[1] * 0.5 * t.cosine() / np.pi
    at = g.position.reshape(-1, 3).astype(np.float64)
    seen = g.depth.ravel() > 0
    exact = np.zeros(len(at))
    exact[seen] = radiance * left_out(t, at[seen], falloff, c)
    wanted = exact.reshape(g.depth.shape)
    found = np.stack(runs)
    assert wanted.max() > 0.05 * radiance
    assert accept(welch_test(block_means(found, 4), block_means(wanted[None], 4), rounding=2e-3 * wanted.mean()))
    whole = found.mean(axis=(1, 2))
    assert accept(welch_test(whole, [wanted.mean()], rounding=2e-3 * wanted.mean()))
    assert not accept(welch_test(1.05 * whole, [wanted.mean()])), "the test would not see an error of 5 %"


def test_nothing_is_left_out_beyond_the_clamp() -> None:
    t = facing(1.0)
    grey = Material("grey", (0.5, 0.5, 0.5))
    engine = CpuEngine(t.scene(grey, grey, suns=[SunLight(t.to_sun, SUN)]))
    g = engine.render_gbuffer(t.camera, SIZE)
    for clamp, nothing in ((0.99, True), (1.3, False)):
        params = Params(clamp_distance=clamp / engine.scene_radius, max_bounces=1)
        assert engine.trace_compensation(g, 0, 64, params)["irradiance"].any() != nothing


def test_no_clamp_leaves_nothing_out() -> None:
    engine = room()
    g = engine.render_gbuffer(CAMERA, SIZE)
    assert not engine.trace_compensation(g, 0, 16, Params(clamp_distance=0))["irradiance"].any()


# --- a closed room ---------------------------------------------------------------------------------------------------


@cache
def room() -> CpuEngine:
    return CpuEngine(occluded_room(points=[PointLight((0.9, 1.5, 0.9), (1.0, 2.0, 4.0))]))


@cache
def traced() -> Array:
    return np.stack([
        path_traced(room(), CAMERA, SIZE, Params(seed=seed), budget=Budget(spp=256)).indirect for seed in range(1, 17)
    ]).sum(axis=-1)  # fmt: skip


def summed(seeds: range, **settings: Any) -> Array:
    """Luminance of brute force, another set of virtual lights each time."""
    return np.stack([
        brute_force(
            room(), CAMERA, SIZE, Params(vpls=8000, seed=seed, **settings), budget=Budget(spp=128)
        ).indirect
        for seed in seeds
    ]).sum(axis=-1)  # fmt: skip


@pytest.mark.parametrize(("falloff", "clamp"), [("clamped", 0.3), ("softened", 0.1)])
def test_virtual_lights_and_compensation_are_the_path_tracer(falloff: str, clamp: float) -> None:
    settings = {"falloff": falloff, "clamp_distance": clamp}
    found = summed(range(101, 117), compensation="path", **settings)
    assert accept(welch_test(block_means(found, 4), block_means(traced(), 4)))
    assert accept(welch_test(found.mean(axis=(1, 2)), traced().mean(axis=(1, 2))))
    assert found.mean() == pytest.approx(traced().mean(), rel=0.02)
    without = summed(range(101, 117), compensation="none", **settings)
    assert without.mean() < 0.97 * traced().mean()
    assert not accept(welch_test(without.mean(axis=(1, 2)), traced().mean(axis=(1, 2)))), "the clamp would be seen"


def test_its_noise_is_reported() -> None:
    settings: dict[str, Any] = {"vpls": 300, "clamp_distance": 0.5}
    with_it, without = (
        brute_force(room(), CAMERA, SIZE, Params(compensation=way, **settings), budget=Budget(spp=512))
        for way in ("path", "none")
    )
    assert without.exact and not without.indirect_variance.any()
    assert not with_it.exact and with_it.indirect_variance.any()
    assert (with_it.indirect >= without.indirect).all() and with_it.indirect.sum() > without.indirect.sum()
    # Every light has its ray already: more samples refine the short paths alone.
    more = brute_force(room(), CAMERA, SIZE, Params(compensation="path", **settings), budget=Budget(spp=2048))
    assert more.indirect_variance.mean() == pytest.approx(with_it.indirect_variance.mean() / 4, rel=0.3)


def test_a_light_list_has_no_compensation() -> None:
    engine = CpuEngine(occluded_room(wall_lights(1, 10)))
    with pytest.raises(LabError, match="compensation=path"):
        brute_force(engine, CAMERA, SIZE, Params(compensation="path"))
