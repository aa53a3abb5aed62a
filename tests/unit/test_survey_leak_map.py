"""``lab.survey``: where a frame is brighter or darker than its reference, and the worst spots."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from lab.errors import LabError
from lab.params import Params
from lab.records import Frame
from lab.reference import Budget, Reference
from lab.renderer import Cancelled
from lab.survey import EFFORTS, LeakMap, leak_map, reference_of

from ..oracle_geometry.scenes import occluded_room, wall_lights
from .test_frame import CAMERA, engine, frame

WEIGHTS = (0.2126, 0.7152, 0.0722)


def reference(indirect: Any, variance: Any = 0.0) -> Reference:
    zero = np.zeros_like(np.asarray(indirect, np.float64))
    return Reference("path_tracer", zero, zero + indirect, zero, zero + variance, zero + variance, 1, False, 1.0)


def with_indirect(indirect: Any, depth: Any = None) -> Frame:
    f = frame((indirect.shape[1], indirect.shape[0]))
    image = dataclasses.replace(f.image, indirect=np.asarray(indirect, np.float32))
    seen = np.ones(indirect.shape[:2]) if depth is None else depth
    return dataclasses.replace(
        f, image=image, gbuffer=dataclasses.replace(f.gbuffer, depth=np.asarray(seen, np.float32))
    )


def random_map(seed: int, shape: tuple[int, int] = (9, 13)) -> tuple[LeakMap, Frame, Reference]:
    random = np.random.default_rng(seed)
    b = random.gamma(1.0, 1.0, (*shape, 3))
    a = (b * random.uniform(0.5, 1.6, (*shape, 1))).astype(np.float32)
    depth = random.random(shape) < 0.8
    a[~depth], b[~depth] = 0, 0
    f, r = with_indirect(a, depth), reference(b, random.uniform(0, 0.01, b.shape))
    return leak_map(f, r), f, r


def test_a_map_by_hand() -> None:
    found, f, r = random_map(1)
    height, width = found.error.shape
    a, b = f.image.indirect.astype(np.float64), r.indirect
    mean = sum(WEIGHTS[c] * b[y, x, c] for y in range(height) for x in range(width) for c in range(3))
    epsilon = 0.01 * mean / (height * width)
    brighter = darker = surely = pixels = 0
    for y in range(height):
        for x in range(width):
            mine, right, deviation = (
                sum(w * v for w, v in zip(WEIGHTS, row, strict=True))
                for row in (a[y, x], b[y, x], np.sqrt(r.indirect_variance[y, x]))
            )
            scale = math.sqrt(right**2 + epsilon**2)
            assert found.error[y, x] == pytest.approx((mine - right) / scale, abs=1e-12)
            assert found.noise[y, x] == pytest.approx(deviation / scale)
            assert found.difference[y, x] == pytest.approx(mine - right, abs=1e-12)
            if f.gbuffer.depth[y, x] > 0:
                pixels += 1
                brighter += (mine - right) / scale > 0.1
                darker += (mine - right) / scale < -0.1
                surely += mine - right > max(0.2 * scale, 3 * deviation)
    assert found.brighter == pytest.approx(brighter / pixels) and found.darker == pytest.approx(darker / pixels)
    assert found.shares(0.2, 3.0)[0] == pytest.approx(surely / pixels) and 0 < surely < brighter
    assert found.energy_ratio == pytest.approx(a.sum() / b.sum())
    floor2 = (0.01 * b.mean()) ** 2
    assert found.rel_mse == pytest.approx(np.mean((a - b) ** 2 / (b**2 + floor2)))
    assert found.rel_mse_noise == pytest.approx(np.mean(r.indirect_variance / (b**2 + floor2)))
    assert found.method == "path_tracer" and brighter > 5 and darker > 5


def test_a_frame_that_is_right() -> None:
    f = frame()
    found = leak_map(f, reference(f.image.indirect))
    assert not found.error.any() and found.brighter == found.darker == 0 and found.energy_ratio == 1
    assert found.worst() == [] if min(found.error.shape) >= 16 else found.worst(block=4) == []


def test_twice_the_light() -> None:
    f = frame()
    found = leak_map(f, reference(f.image.indirect.astype(np.float64) / 2))
    lit = found.luminance > found.luminance.mean()
    np.testing.assert_allclose(found.error[lit], 1, rtol=1e-3)
    assert found.energy_ratio == pytest.approx(2) and found.brighter > 0.9 and found.darker == 0


def test_planted_spots_are_found() -> None:
    """Three spots of known light: the one with the most first, wherever it lies and however dark its surroundings."""
    right = np.full((40, 60, 3), 1.0)
    right[:, :20] = 0.01
    wrong = right.copy()
    wrong[5:13, 3:11] += 0.8  # a leak in the dark
    wrong[20:28, 41:49] -= 0.5
    wrong[33:37, 22:26] += 0.9
    wrong[34, 23] += 0.5
    spots = leak_map(with_indirect(wrong), reference(right)).worst(5, 8)
    assert [(s.left, s.top) for s in spots[:2]] == [(3, 5), (41, 20)] and len(spots) == 3
    whole = right[..., 0].sum()
    sums = [64 * 0.8, 64 * 0.5, 16 * 0.9 + 0.5]
    np.testing.assert_allclose([s.weight * whole for s in spots], sums, rtol=1e-5)
    assert (spots[2].x, spots[2].y) == (23, 34), "its worst pixel"
    assert [s.error > 0 for s in spots] == [True, False, True]
    assert spots[0].error == pytest.approx(0.8 / math.hypot(0.01, 0.01 * right.mean()), rel=1e-5)
    assert spots[1].error == pytest.approx(-0.5, rel=1e-3)


@pytest.mark.parametrize(("seed", "block"), [(1, 1), (2, 3), (3, 4), (4, 9)])
def test_worst_spots_by_hand(seed: int, block: int) -> None:
    """Greedy search over every place of the block; what the reference's own noise could be does not count."""
    found, _, _ = random_map(seed)
    height, width = found.error.shape
    spots = found.worst(6, block, 3.0)
    taken: list[tuple[int, int]] = []
    for spot in spots:
        best, place = 0.0, (0, 0)
        for top in range(height - block + 1):
            for left in range(width - block + 1):
                if any(abs(top - y) < block and abs(left - x) < block for y, x in taken):
                    continue
                pixels = [(y, x) for y in range(top, top + block) for x in range(left, left + block)]
                total = abs(sum(found.difference[p] for p in pixels))
                noise = math.sqrt(sum(found.deviation[p] ** 2 for p in pixels))
                if total > max(best * (1 + 1e-9), 3 * noise):
                    best, place = total, (top, left)
                if (top, left) == (spot.top, spot.left):
                    assert spot.noise / abs(spot.error) == pytest.approx(noise / total)
        assert (spot.top, spot.left) == place
        assert spot.weight == pytest.approx(best / found.luminance.sum())
        assert spot.left <= spot.x < spot.left + block and spot.top <= spot.y < spot.top + block
        sign = 1 if spot.error > 0 else -1
        inside = sign * found.difference[spot.top : spot.top + block, spot.left : spot.left + block]
        assert sign * found.difference[spot.y, spot.x] == inside.max()
        taken.append(place)
    assert len(spots) >= (6 if block < 4 else 1)
    assert found.worst(6, block, 1e9) == []
    assert [s.weight for s in spots] == sorted((s.weight for s in spots), reverse=True)


@pytest.mark.parametrize("radius", [0, 1, 20])
def test_a_smoothed_map_by_hand(radius: int) -> None:
    found, f, _ = random_map(7)
    height, width = found.error.shape
    smooth = found.smoothed(radius)
    for y in range(height):
        for x in range(width):
            near = [
                (v, u)
                for v in range(max(0, y - radius), min(height, y + radius + 1))
                for u in range(max(0, x - radius), min(width, x + radius + 1))
                if found.seen[v, u]
            ]
            wanted = 0.0
            if found.seen[y, x]:
                wrong, right = (sum(a[p] for p in near) / len(near) for a in (found.difference, found.luminance))
                wanted = wrong / math.hypot(right, 0.01 * found.luminance.mean())
            assert smooth[y, x] == pytest.approx(wanted, abs=1e-9)
    if radius == 0:
        np.testing.assert_allclose(smooth, found.error, atol=1e-12)
    assert 0 < (f.gbuffer.depth > 0).sum() < height * width


def test_what_can_not_be_compared() -> None:
    found, f, _ = random_map(1)
    with pytest.raises(LabError, match=r"13x9.*4x9"):
        leak_map(f, reference(np.ones((9, 4, 3))))
    for block in (0, 10, 2.5):
        with pytest.raises(LabError, match="block"):
            found.worst(3, block)  # type: ignore[arg-type]
    with pytest.raises(LabError, match="radius"):
        found.smoothed(-1)
    with pytest.raises(LabError, match="count"):
        found.worst(0, 4)


@pytest.mark.parametrize("method", ["path_tracer", "brute_force"])
def test_the_reference_of_a_frame(method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Broken off, it is kept and taken up again; it judges the frame's own view and settings."""
    monkeypatch.setenv("LAB_CACHE", str(tmp_path))
    f = frame((12, 8))
    said: list[float] = []

    def stop(share: float, _: str) -> None:
        said.append(share)
        if len(said) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        reference_of(engine().scene, f, method, Budget(spp=128), stop, engine=engine())
    assert len(said) == 3 and list(tmp_path.rglob("*.npz"))
    found = reference_of(engine().scene, f, method, Budget(spp=128), engine=engine())
    whole = lab.reference.render_reference(
        engine().scene, method, f.params, camera=CAMERA, size=(12, 8), budget=Budget(spp=128), cache=False
    )
    np.testing.assert_allclose(found.indirect, whole.indirect, rtol=1e-12)
    judged = leak_map(f, found)
    assert judged.method == method and 0.3 < judged.energy_ratio < 2


def test_references_that_do_not_exist() -> None:
    f = frame((6, 4))
    with pytest.raises(LabError, match="quick"):
        reference_of(engine().scene, f, effort="quik")
    with pytest.raises(LabError, match="brute_force"):
        reference_of(engine().scene, f, "brute_forc")
    room = occluded_room(wall_lights(4, 30))
    with pytest.raises(LabError, match="brute_force"):
        reference_of(room, f)
    listed = lab.render(room, Params(), camera=CAMERA, size=(6, 4))
    assert reference_of(room, listed, "brute_force", Budget(spp=64), cache=False).exact
    assert all(effort.error and effort.seconds for effort in EFFORTS.values())
