"""Energy compensation of the clamp in a frame: short paths a pixel, filtered, added to the indirect layer."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import lab
from lab import _core
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.records import Frame
from lab.scene.scene import Camera, PointLight, Scene

from ..oracle_geometry.scenes import occluded_room, wall_lights

CAMERA = Camera("c", (1.6, 1.2, 1.8), (-0.3, 0.8, -0.4), fov_y_deg=80.0)
SIZE = (36, 20)
SETTINGS: dict[str, Any] = {"vpls": 300, "clamp_distance": 0.3, "compensation": "path"}


@cache
def engine() -> CpuEngine:
    return CpuEngine(occluded_room(points=[PointLight((0.9, 1.5, 0.9), (1.0, 2.0, 4.0))]))


def frame(**settings: Any) -> Frame:
    return lab.render(engine().scene, Params(**SETTINGS | settings), camera=CAMERA, size=SIZE, engine=engine())


def same(a: Any, b: Any) -> list[str]:
    """The arrays of two records of one kind that are equal, bit by bit."""
    names = [f.name for f in dataclasses.fields(a)]
    return [name for name in names if np.array_equal(getattr(a, name), getattr(b, name))]


def test_without_it_there_is_nothing_to_add() -> None:
    f = frame(compensation="none")
    assert f.shadows.left_out is None and f.filtered.left_out is None
    assert Params().compensation == "none"


@pytest.mark.parametrize("backend", ["fused", "kornia"])
@pytest.mark.parametrize("name", ["atrous_variance", "atrous", "atrous_plane", "bilateral", "none"])
def test_the_indirect_layer_has_it(name: str, backend: str) -> None:
    """Whatever filters it: light on top of the same frame without it, and in no other layer."""
    if backend == "kornia":
        pytest.importorskip("kornia")
    with_it, without = (frame(compensation=way, filter=name, filter_backend=backend) for way in ("path", "none"))
    g, filtered = with_it.gbuffer, with_it.filtered.left_out
    assert filtered is not None and filtered.shape == (*g.depth.shape, 3) and filtered.dtype == np.float32
    assert np.isfinite(filtered).all() and (filtered >= 0).all()
    added = with_it.image.indirect - without.image.indirect
    np.testing.assert_allclose(added, filtered * g.albedo / np.pi, rtol=1e-4, atol=1e-6 * with_it.image.indirect.max())
    assert added.sum() > 0.05 * without.image.indirect.sum(), "the clamp is wide here: much is left out"
    assert set(same(with_it.image, without.image)) == {"direct", "unshadowed", "shadow_ratio"}
    np.testing.assert_allclose(with_it.image.colour, with_it.image.direct + with_it.image.indirect, rtol=1e-6)


def test_unfiltered_it_is_what_the_paths_found() -> None:
    f = frame(filter="none")
    assert f.shadows.left_out is not None and f.filtered.left_out is not None
    assert np.array_equal(f.filtered.left_out, f.shadows.left_out)
    assert f.filtered.left_out is not f.shadows.left_out


@pytest.mark.parametrize("samples", [1, 4, 64])
def test_it_is_the_mean_of_the_reference_s_paths(samples: int) -> None:
    """Frame n takes samples n k .. n k + k - 1, the ones that the reference would take there."""
    for number in (0, 3):
        f = frame(compensation_samples=samples, frame=number)
        sums = engine().trace_compensation(f.gbuffer, number * samples, samples, f.params)["irradiance"]
        np.testing.assert_allclose(f.shadows.left_out, sums / samples, rtol=1e-6)


def test_the_filter_takes_noise_out_and_leaves_the_mean() -> None:
    """relMSE against 512 paths a pixel goes down; what is there on the whole stays."""
    f = frame()
    noisy, filtered = f.shadows.left_out, f.filtered.left_out
    assert noisy is not None and filtered is not None
    # Pixels are far apart in a picture this small: the filter's reach must span them.
    filtered = engine().filter_shadows(f.gbuffer, f.shadows, f.params.replace(sigma_position=0.1)).left_out
    many = engine().trace_compensation(f.gbuffer, 10_000, 512, f.params)["irradiance"] / 512
    error = [((x - many) ** 2).sum() for x in (noisy, filtered)]
    assert error[1] < error[0] / 3
    assert filtered.sum() == pytest.approx(noisy.sum(), rel=0.1)
    assert noisy.sum() == pytest.approx(many.sum(), rel=0.25), "the few paths of this very frame"


def test_frames_and_seeds_have_their_own_noise() -> None:
    first = frame()
    assert np.array_equal(first.shadows.left_out, frame().shadows.left_out)
    for other in (frame(frame=1), frame(seed=1), frame(frame=2**32 - 1)):
        assert other.shadows.left_out is not None and first.shadows.left_out is not None
        assert (other.shadows.left_out != first.shadows.left_out).mean() > 0.2
        assert other.shadows.left_out.sum() == pytest.approx(first.shadows.left_out.sum(), rel=0.2)


def test_more_samples_have_less_noise() -> None:
    few, many = (
        np.stack([frame(compensation_samples=k, frame=i).shadows.left_out for i in range(12)]).var(axis=0).mean()
        for k in (1, 16)
    )
    assert many == pytest.approx(few / 16, rel=0.25)


def test_without_a_clamp_nothing_is_left_out() -> None:
    f, without = frame(clamp_distance=0), frame(clamp_distance=0, compensation="none")
    for left_out in (f.shadows.left_out, f.filtered.left_out):
        assert left_out is not None and not left_out.any()
    assert len(same(f.image, without.image)) == len(dataclasses.fields(f.image))


@pytest.mark.parametrize("falloff", ["clamped", "softened"])
def test_a_wider_clamp_leaves_out_more(falloff: str) -> None:
    sums = [
        float(frame(clamp_distance=c, falloff=falloff, filter="none").shadows.left_out.sum())  # type: ignore[union-attr]
        for c in (0.02, 0.1, 0.5)
    ]
    assert 0 < sums[0] < sums[1] / 2 < sums[2] / 4


@pytest.mark.parametrize("interleave", [1, 4])
def test_interleaving_and_no_shadows_leave_it_alone(interleave: int) -> None:
    """It belongs to its pixel: tiles are recombined without it, and shadow_samples=0 does not drop it."""
    f = frame(interleave=interleave, shadow_samples=0, filter="none")
    without = frame(interleave=interleave, shadow_samples=0, filter="none", compensation="none")
    added = f.image.indirect - without.image.indirect
    assert f.shadows.left_out is not None
    wanted = f.shadows.left_out * f.gbuffer.albedo / np.pi
    np.testing.assert_allclose(added, wanted, rtol=1e-4, atol=1e-6 * f.image.indirect.max())


@pytest.fixture
def threads() -> Iterator[Any]:
    """Sets the number of threads, and puts it back."""
    before = _core.info()["threads"]
    yield _core.set_threads
    _core.set_threads(before)


def test_any_number_of_threads_gives_the_same_bits(threads: Any) -> None:
    frames = []
    for count in (1, 2, 3):
        threads(count)
        frames.append(frame())
    for other in frames[1:]:
        assert {"left_out", "shadowed", "area"} <= set(same(frames[0].shadows, other.shadows))
        assert len(same(frames[0].filtered, other.filtered)) == len(dataclasses.fields(other.filtered))
        assert len(same(frames[0].image, other.image)) == len(dataclasses.fields(other.image))


def test_a_light_list_has_no_surfaces_to_find() -> None:
    lights = wall_lights(1, 10)
    scene: Scene = occluded_room(lights)
    with pytest.raises(LabError, match=r"compensation=path: .* is lit by a list of point lights.*leave it at none"):
        lab.render(scene, Params(**SETTINGS), camera=CAMERA, size=SIZE)
    assert lab.render(scene, Params(), camera=CAMERA, size=SIZE).shadows.left_out is None
