"""A pixel's picks drawn again and again, what its shadow estimator expects, and float64 loops over every ray."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.errors import LabError
from lab.pixel import ExactShadow, exact_shadow, probe_pixel, sample_pixel

from ..oracle_geometry.grids import contributions, member_shares, omegas, pick_weights
from ..oracle_geometry.probed import HIDDEN, engine, room_frame
from ..oracle_geometry.rays import free
from ..oracle_geometry.scenes import triangles_of

PIXELS = [(4, 12), (14, 9), (20, 4)]
CASES: dict[str, dict[str, Any]] = {
    "ours": {},
    "race, one candidate": {"picker": "race", "member_candidates": 1, "omega_max": "none"},
    "even picks, scatter": {"importance": False, "construction": "scatter"},
    "from level 2, average": {"first_shadow_level": 2, "shadow_estimator": "average", "lobe": "mean_energy"},
    "corrected, low cap": {"shadow_estimator": "corrected", "omega_max": 0.5},
    "rgb": {"shadow_estimator": "ratio_rgb", "shadow_samples": 3},
    "rgb, even": {"shadow_estimator": "ratio_rgb", "importance": False, "first_shadow_level": 1},
}
OTHERS: dict[str, dict[str, Any]] = {
    "soft": {"receiver": "soft"},
    "interleaved": {"interleave": 2, "shadow_samples": 1},
    "interleaved, race": {"interleave": 4, "deal_all": True, "picker": "race"},
    "jittered": {"shadow_points": "jitter", "first_shadow_level": 1},
    "paper": {
        "shadow_points": "jitter", "shadow_estimator": "average", "first_shadow_level": 1, "first_level": 1,
        "deviation_scale": 2.0,
    },
    "jittered rgb": {"shadow_points": "jitter", "shadow_estimator": "ratio_rgb", "first_shadow_level": 1},
}  # fmt: skip


def brute(frame: Any, x: int, y: int, found: ExactShadow) -> dict[str, np.ndarray]:
    """Everything that is expected, from the definitions: lights by members, with rays against every triangle."""
    h, params, g = frame.hierarchy, frame.params, frame.gbuffer
    at, normal = g.position[y, x].astype(np.float64)[None], g.normal[y, x].astype(np.float64)[None]
    n = int(h.offset[1])
    origin = np.repeat(at + 2e-5 * g.geometric_normal[y, x], n, axis=0)
    is_free, sure = free(triangles_of(engine().scene), origin, h.position[:n].astype(np.float64), edge=1e-5, ends=1e-4)
    assert sure.mean() > 0.95
    v = is_free.astype(np.float64)
    c = contributions(h, at, normal, params, engine().scene_radius)
    f = pick_weights(h, c, params)[0]
    share, omega = member_shares(h, params.construction), omegas(h, at, normal, params)[0]
    if params.shadow_estimator == "average":
        omega = np.ones_like(omega)
    p = f / f.sum()
    each = {"visible_share": share @ v, "light_weight": (share * omega).sum(1), "light_shadowed": (share * omega) @ v}
    factor = np.where((f > 0)[:, None], c[0], 0) if params.shadow_estimator == "ratio_rgb" else p[:, None]
    sums = {"shadowed": each["light_shadowed"] @ factor, "weight": each["light_weight"] @ factor}
    if params.shadow_estimator == "corrected":
        sums["weight"] = np.ones(1)
    return {name: values[found.index] for name, values in each.items()} | sums | {"mean_visibility": p @ (share @ v)}


@pytest.mark.parametrize("case", CASES)
def test_the_all_rays_value_is_brute_force(case: str) -> None:
    frame = room_frame(**CASES[case])
    for x, y in PIXELS:
        found = exact_shadow(engine(), frame, x, y)
        wanted = brute(frame, x, y, found)
        scale = wanted["weight"].max()
        for name in ("visible_share", "light_weight", "light_shadowed", "mean_visibility"):
            np.testing.assert_allclose(getattr(found, name), wanted[name], rtol=1e-3, atol=1e-4, err_msg=name)
        for name in ("shadowed", "weight"):
            np.testing.assert_allclose(getattr(found, name), wanted[name], rtol=2e-4, atol=1e-4 * scale, err_msg=name)
        np.testing.assert_allclose(found.ratio, found.shadowed / found.weight)
        assert found.points == 0 and not found.shadowed_error.any() and found.mean_visibility_error == 0
        assert 0 < found.rays <= len(frame.hierarchy.input_index), "a ray a light, not a ray a member"


@pytest.mark.parametrize("case", CASES | OTHERS)
def test_many_draws_meet_what_is_expected(case: str) -> None:
    """Picks follow p; S, U, their ratio and the mean visibility lie within four standard errors."""
    frame = room_frame(**(CASES | OTHERS)[case])
    hidden = 0
    for x, y in PIXELS:
        drawn = sample_pixel(engine(), frame, x, y, 4000, seed=5)
        wanted = exact_shadow(engine(), frame, x, y, points=1024)
        probe = probe_pixel(engine(), frame, x, y)
        k = frame.params.shadow_samples
        assert drawn.draws == drawn.copies * k >= 4000 > drawn.draws - k
        assert drawn.count.sum() == drawn.draws
        lit = probe.lights.take(probe.lights.probability > 0)
        np.testing.assert_array_equal(drawn.index, lit.index)
        np.testing.assert_array_equal(drawn.probability, lit.probability)
        assert drawn.p_value > 1e-3 and (drawn.freedom > 0 or frame.params.interleave > 1)
        pairs = [
            (drawn.shadowed, drawn.shadowed_error, wanted.shadowed, wanted.shadowed_error),
            (drawn.weight, drawn.weight_error, wanted.weight, 0.0),
            (drawn.ratio, drawn.ratio_error, wanted.ratio, wanted.ratio_error),
            (
                drawn.mean_visibility, drawn.mean_visibility_error, wanted.mean_visibility,
                wanted.mean_visibility_error,
            ),
        ]  # fmt: skip
        for mine, error, theirs, also in pairs:
            sigma = np.hypot(error, also)
            assert (np.abs(mine - theirs) <= 4 * sigma + 2e-4 * np.abs(theirs)).all()
        rows = np.searchsorted(wanted.index, drawn.index)
        often = drawn.count > 200
        v = wanted.visible_share[rows][often]
        sigma = np.sqrt(np.maximum(v * (1 - v), 1e-3) / drawn.count[often] + v * (1 - v) / 1024)
        assert (np.abs(drawn.visible_share[often] - v) < 4.5 * sigma).all()
        np.testing.assert_allclose(drawn.mean_visibility, drawn.visible.sum() / drawn.draws)
        hidden += int(0.03 < wanted.mean_visibility < 0.97)
    assert hidden >= 2, "nothing is hidden: the test tells nothing"


def test_another_seed_draws_others_and_the_same_the_same() -> None:
    frame = room_frame()
    a, b, c = (sample_pixel(engine(), frame, *PIXELS[0], 500, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.count, b.count)
    assert (a.count != c.count).any() and a.shadowed != c.shadowed


def test_many_draws_go_in_turns() -> None:
    drawn = sample_pixel(engine(), room_frame(shadow_samples=1), *PIXELS[0], 9001)
    assert drawn.draws == 9001 and drawn.p_value > 1e-3


def test_errors_are_those_of_repeated_trials() -> None:
    frame = room_frame()
    runs = [sample_pixel(engine(), frame, *PIXELS[1], 400, seed=seed) for seed in range(60)]
    for name in ("shadowed", "weight", "ratio", "mean_visibility"):
        spread = np.std([getattr(run, name) for run in runs], ddof=1)
        told = np.sqrt(np.mean([np.square(getattr(run, f"{name}_error")) for run in runs]))
        assert spread == pytest.approx(told, rel=0.3), name


def test_a_pixel_that_sees_nothing() -> None:
    for settings in ({}, {"shadow_points": "jitter"}):
        frame = room_frame(**settings)
        drawn, exact = sample_pixel(engine(), frame, *HIDDEN), exact_shadow(engine(), frame, *HIDDEN)
        assert drawn.draws == 0 and len(drawn.count) == 0 and drawn.p_value == 1 and np.isnan(drawn.ratio).all()
        assert exact.rays == 0 and len(exact.index) == 0 and np.isnan(exact.ratio).all()


def test_a_frame_without_shadow_samples() -> None:
    """Nothing can be drawn, but what would be expected is known."""
    frame = room_frame(shadow_samples=0)
    with pytest.raises(LabError, match="shadow_samples=0"):
        sample_pixel(engine(), frame, 0, 0)
    bare, full = (exact_shadow(engine(), f, *PIXELS[0]) for f in (frame, room_frame()))
    np.testing.assert_allclose(bare.ratio, full.ratio)


@pytest.mark.parametrize("draws", [0, -1, 1.5, 2**30])
def test_numbers_of_draws_are_checked(draws: int) -> None:
    with pytest.raises(LabError, match="whole number from 1"):
        sample_pixel(engine(), room_frame(), 0, 0, draws)
    with pytest.raises(LabError, match="whole number from 2"):
        exact_shadow(engine(), room_frame(), 0, 0, points=draws)
