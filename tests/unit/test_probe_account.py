"""Who answers for a pixel's error: rows against float64 loops, sums against the frame and against every light."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.pixel import account, exact_shadow, probe_pixel

from ..oracle.lighting import exact_sum
from ..oracle.pixel import table
from ..oracle.pure import luminance
from ..oracle_geometry.grids import member_shares
from ..oracle_geometry.probed import HIDDEN, LIGHTS, engine, room_frame

PIXELS = [(4, 12), (14, 9), (20, 4)]
CASES: dict[str, dict[str, Any]] = {
    "ours": {},
    "filtered": {"filter": "atrous"},
    "softened, from level 1": {"falloff": "softened", "clamp_distance": 0.1, "first_level": 1},
    "soft, scatter": {"receiver": "soft", "construction": "scatter"},
    "interleaved": {"interleave": 2},
    "rgb": {"shadow_estimator": "ratio_rgb"},
    "corrected": {"shadow_estimator": "corrected"},
    "jittered": {"shadow_points": "jitter", "shadow_estimator": "average"},
    "half open": {"gather_range": "half_open"},
    "no shadows": {"shadow_samples": 0},
}


@pytest.mark.parametrize("case", CASES)
def test_rows_sum_to_frame_minus_truth(case: str) -> None:
    frame = room_frame(**CASES[case])
    for x, y in PIXELS:
        found = account(engine(), frame, x, y)
        total = found.difference.sum(axis=0) + found.remainder + found.recombination
        np.testing.assert_allclose(total, found.frame - found.truth, atol=1e-7 * found.truth.max())
        shown = frame.image.unshadowed[y, x] * frame.image.shadow_ratio[y, x].astype(np.float64)
        np.testing.assert_allclose(found.frame, shown)
        truth = engine().brute_force(LIGHTS, frame.gbuffer, (y, y + 1), frame.params, draws=0, pass_number=0)
        np.testing.assert_allclose(found.truth, truth["irradiance"][0, x], rtol=1e-5)
        if frame.params.interleave == 1:
            assert np.abs(found.recombination).max() < 1e-5 * found.frame.max()
            np.testing.assert_allclose(found.sent.sum(axis=0), frame.image.unshadowed[y, x], rtol=1e-4)
        assert (found.remainder <= 0).all() and (np.diff(found.index) > 0).all()


@pytest.mark.parametrize("case", ["ours", "softened, from level 1", "soft, scatter", "interleaved"])
def test_each_row_against_float64(case: str) -> None:
    frame = room_frame(**CASES[case])
    h, params, g = frame.hierarchy, frame.params, frame.gbuffer
    n = int(h.offset[1])
    bright = luminance(h.flux)
    held_by = member_shares(h, params.construction) * bright[:, None] / bright[:n]  # w_ij
    for x, y in PIXELS:
        found = account(engine(), frame, x, y)
        at, normal = g.position[y, x], g.normal[y, x]
        drawn = (np.arange(len(h.position)) >= h.offset[params.first_level]).astype(np.float64)
        lights = table(h, at, normal, params.replace(interleave=1), engine().scene_radius, drawn)
        visible = engine().visible(g, y, x, np.ascontiguousarray(h.position[:n]))
        arriving = np.stack(
            [exact_sum(_one(h, j), at[None], normal[None], params, engine().scene_radius)[0] for j in range(n)]
        )
        arriving *= visible[:, None]
        stake = lights.blend[:, None] * held_by * drawn[:, None]
        times = stake.sum(axis=0)
        part = (stake / np.maximum(1, times)) @ arriving
        scale = arriving.sum(axis=0).max()
        np.testing.assert_allclose(found.stands_for, part[found.index], rtol=1e-3, atol=1e-5 * scale)
        others = np.setdiff1d(np.arange(len(part)), found.index)
        assert part[others].sum() < 1e-5 * scale and lights.bright[others].sum() < 1e-5 * scale
        np.testing.assert_allclose(found.sent, lights.contribution[found.index], rtol=1e-3, atol=1e-5 * scale)
        np.testing.assert_allclose(found.remainder, -(np.maximum(0, 1 - times) @ arriving), atol=1e-4 * scale)
        weight = luminance(arriving)
        assert found.times_held == pytest.approx(weight @ times / weight.sum(), rel=1e-3)
        assert found.rays <= n


def _one(h: Any, j: int) -> Any:
    from lab.records import Lights

    return Lights(h.position[j : j + 1], h.flux[j : j + 1], h.normal[j : j + 1] * h.oriented[j])


def test_lights_that_are_drawn_themselves_answer_for_nothing() -> None:
    """With every light drawn at its own place, each is its own truth; the rest is the shadow they share."""
    frame = room_frame(alpha=1000.0)
    for x, y in PIXELS:
        found = account(engine(), frame, x, y)
        assert (found.level == 0).all() and found.times_held == pytest.approx(1)
        scale = 1e-6 * found.truth.max()
        np.testing.assert_allclose(found.shadowed_alone, found.stands_for, rtol=1e-4, atol=scale)
        np.testing.assert_allclose(found.remainder, 0, atol=scale)


@pytest.mark.parametrize("case", ["ours", "corrected", "jittered"])
def test_alone_is_by_the_lights_own_rays(case: str) -> None:
    frame = room_frame(**CASES[case])
    x, y = PIXELS[1]
    found, exact = account(engine(), frame, x, y), exact_shadow(engine(), frame, x, y)
    rows = np.searchsorted(found.index, exact.index)
    own = exact.light_shadowed / (1 if case == "corrected" else exact.light_weight)
    np.testing.assert_allclose(found.shadowed_alone[rows], found.sent[rows] * own[:, None], rtol=1e-6)
    sent = probe_pixel(engine(), frame, x, y).lights.contribution
    np.testing.assert_array_equal(found.sent[rows], sent)
    assert not found.sent[np.setdiff1d(np.arange(len(found.index)), rows)].any()


def test_sorted_puts_the_greatest_first() -> None:
    found = account(engine(), room_frame(), *PIXELS[0])
    ranked = found.sorted()
    size = np.abs(luminance(ranked.difference))
    assert (np.diff(size) <= 0).all() and sorted(ranked.index) == found.index.tolist()
    np.testing.assert_allclose(ranked.difference, ranked.shadowed - ranked.stands_for)
    assert ranked.times_held == found.times_held


def test_a_pixel_that_sees_nothing() -> None:
    found = account(engine(), room_frame(), *HIDDEN)
    assert len(found.index) == 0 and found.rays == 0 and np.isnan(found.times_held)
    assert not found.frame.any() and not found.truth.any() and not found.remainder.any()
