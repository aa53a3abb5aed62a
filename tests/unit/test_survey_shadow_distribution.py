"""``lab.survey``: where shadow samples go, against loops over every pick and against exact probabilities."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import lab
from lab.engine.cpu import CpuEngine
from lab.errors import LabError
from lab.params import Params
from lab.records import Frame, Lights
from lab.renderer import Cancelled
from lab.survey import compare_importance, sampled_distribution, shadow_distribution
from lab.survey.shadow_distribution import ShadowDistribution

from ..oracle_geometry.grids import contributions, levels_of, pick_weights
from ..oracle_geometry.scenes import occluded_room, points_as_gbuffer, wall_lights
from ..oracle_geometry.trials import NORMAL, POSITION
from .test_frame import CAMERA, arrays, engine, frame

LIGHTS = wall_lights(3, 60)
MAPS = ("level_share", "entropy", "effective_lights", "blocked")


def same(a: ShadowDistribution, b: ShadowDistribution) -> bool:
    return all(np.array_equal(x, y, equal_nan=True) for (_, x), (_, y) in zip(arrays(a), arrays(b), strict=True))


def by_hand(f: Frame) -> dict[str, Any]:
    """Everything in a distribution, pick by pick."""
    h, lighting, shadows = f.hierarchy, f.lighting, f.shadows
    height, width, k = lighting.light.shape
    levels = levels_of(h)
    found: dict[str, Any] = {name: np.full((height, width), np.nan) for name in MAPS[1:]}
    found["level_share"] = np.full((h.top + 1, height, width), np.nan)
    found |= {f"light_{what}": np.zeros(len(levels), np.int64) for what in ("picks", "rays", "blocked")}
    for y in range(height):
        for x in range(width):
            p, bits, rays, blocked = [], [], 0, 0
            level = np.zeros(h.top + 1)
            for s in range(k):
                light = int(lighting.light[y, x, s])
                if light < 0:
                    continue
                p.append(float(lighting.target_weight[y, x, s]) / float(lighting.weight_sum[y, x]))
                bits.append(-math.log2(p[-1]))
                level[levels[light]] += 1
                found["light_picks"][light] += 1
                if shadows.omega[y, x, s] > 0 or f.params.shadow_estimator == "average":
                    rays += 1
                    found["light_rays"][light] += 1
                    if not shadows.visible[y, x, s]:
                        blocked += 1
                        found["light_blocked"][light] += 1
            if p:
                found["entropy"][y, x] = sum(bits) / len(bits)
                found["effective_lights"][y, x] = len(p) / sum(p)
                found["level_share"][:, y, x] = level / len(p)
            if rays:
                found["blocked"][y, x] = blocked / rays
    for what in ("picks", "rays", "blocked"):
        found[f"level_{what}"] = np.array(
            [found[f"light_{what}"][levels == level].sum() for level in range(h.top + 1)], np.int64
        )
    return found


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"importance": False, "shadow_samples": 2, "picker": "race"},
        {"shadow_estimator": "average", "shadow_points": "members"},
        {"shadow_points": "jitter", "first_shadow_level": 2, "interleave": 2},
    ],
    ids=str,
)
def test_a_distribution_by_hand(settings: dict[str, Any]) -> None:
    f = frame(**settings)
    found, wanted = shadow_distribution(f), by_hand(f)
    for name, value in wanted.items():
        if value.dtype.kind == "i":
            np.testing.assert_array_equal(getattr(found, name), value, err_msg=name)
        else:
            np.testing.assert_allclose(getattr(found, name), value, rtol=1e-6, atol=1e-9, err_msg=name)
    assert np.isnan(found.entropy).any() and np.isfinite(found.entropy).any(), "pixels without and with picks"
    assert found.picks == f.params.shadow_samples
    assert found.level_shares.sum() == pytest.approx(1.0)
    summary = found.summary()
    assert summary["entropy"] == pytest.approx(np.nanmean(wanted["entropy"]))
    assert summary["effective_lights"] == pytest.approx(1 / np.nanmean(1 / wanted["effective_lights"]))
    assert summary["mean_level"] == pytest.approx(np.average(levels_of(f.hierarchy), weights=wanted["light_picks"]))
    assert summary["blocked"] == pytest.approx(wanted["light_blocked"].sum() / wanted["light_rays"].sum())
    assert summary["without_ray"] == pytest.approx(1 - wanted["light_rays"].sum() / wanted["light_picks"].sum())
    assert summary["lights_picked"] == (wanted["light_picks"] > 0).sum()
    share = wanted["level_share"]
    np.testing.assert_allclose(
        found.mean_level, sum(level * share[level] for level in range(len(share))), rtol=1e-6, atol=1e-6
    )
    with np.errstate(invalid="ignore"):
        np.testing.assert_allclose(found.level_blocked_shares, wanted["level_blocked"] / wanted["level_rays"])


def test_the_lights_picked_most() -> None:
    found = shadow_distribution(frame())
    top = found.top_lights(5)
    order = sorted(range(len(found.light_picks)), key=lambda i: (-found.light_picks[i], i))
    assert [light.light for light in top] == order[:5]
    for light in top:
        assert found.offset[light.level] <= light.light < found.offset[light.level + 1]
        assert light.picks == found.light_picks[light.light]
        assert light.share == pytest.approx(light.picks / found.light_picks.sum())
        assert light.blocked == pytest.approx(found.light_blocked[light.light] / found.light_rays[light.light])
    assert len(found.top_lights(10**6)) == (found.light_picks > 0).sum(), "only lights that were picked"
    edges, lights = found.picks_histogram()
    assert edges[:4].tolist() == [0, 1, 2, 4] and lights.sum() == len(found.light_picks)
    for i, number in enumerate(lights):
        assert number == ((found.light_picks >= edges[i]) & (found.light_picks < edges[i + 1])).sum()


def test_passes_add_up() -> None:
    """Picks in one pass are the frame's own; more are those of the frames after it, too."""
    f = frame(shadow_samples=16, frame=2**32 - 1)
    assert same(sampled_distribution(engine(), f, 16), shadow_distribution(f))
    said: list[float] = []
    both = sampled_distribution(engine(), f, 20, lambda share, _: said.append(share))
    assert said == [0.0, 0.8, 1.0] and both.picks == 20
    params = f.params.replace(frame=0, shadow_samples=4)
    second = shadow_distribution(lab.render(engine().scene, params, camera=CAMERA, size=f.gbuffer.size))
    np.testing.assert_array_equal(both.light_picks, shadow_distribution(f).light_picks + second.light_picks)
    np.testing.assert_array_equal(both.level_blocked, shadow_distribution(f).level_blocked + second.level_blocked)
    mean = (16 * shadow_distribution(f).entropy + 4 * second.entropy) / 20
    np.testing.assert_allclose(both.entropy, mean, rtol=1e-12)


def at_receivers(lights: Lights, params: Params) -> tuple[CpuEngine, Frame]:
    """Six points of the room as the pixels of a frame."""
    scene_engine = CpuEngine(occluded_room(lights))
    g = points_as_gbuffer(POSITION[None], NORMAL[None])
    h = scene_engine.build_hierarchy(lights, params)
    rest: Any = None
    return scene_engine, Frame(rest, lights, h, g, rest, rest, rest, params, rest)


@pytest.mark.parametrize("importance", [True, False])
def test_many_picks_approach_the_exact_distribution(importance: bool) -> None:
    """Entropy, effective number of lights and level shares of the exact f of every light, in float64."""
    params = Params(levels=3, alpha=0.7, importance=importance)
    scene_engine, f = at_receivers(LIGHTS, params)
    n = 4096
    found = sampled_distribution(scene_engine, f, n)
    exact = contributions(f.hierarchy, POSITION, NORMAL / np.linalg.norm(NORMAL, axis=1)[:, None], params,
                          scene_engine.scene_radius)  # fmt: skip
    weights = pick_weights(f.hierarchy, exact, params)
    p = weights / weights.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore"):
        bits = np.where(p > 0, -np.log2(p), 0)
    entropy, simpson = (p * bits).sum(axis=1), (p * p).sum(axis=1)
    # Standard errors of the means over n independent picks, plus rounding.
    for value, mean, each in ((found.entropy[0], entropy, bits), (1 / found.effective_lights[0], simpson, p)):
        sigma = np.sqrt(((each - mean[:, None]) ** 2 * p).sum(axis=1) / n)
        assert (np.abs(value - mean) < 4.5 * sigma + 1e-5).all()
    for level in range(f.hierarchy.top + 1):
        share = p[:, levels_of(f.hierarchy) == level].sum(axis=1)
        sigma = np.sqrt(share * (1 - share) / n)
        assert (np.abs(found.level_share[level, 0] - share) < 4.5 * sigma + 1e-5).all()
    other = pick_weights(f.hierarchy, exact, params.replace(importance=not importance))
    q = other / other.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        wrong = -np.where(q > 0, q * np.log2(q), 0).sum(axis=1)
    assert (np.abs(found.entropy[0] - wrong) > 0.1).all(), "the other way to pick is told apart"


def test_one_light_behind_a_slab() -> None:
    # A second, dark one: a hierarchy of a single point has no extent that blending could be wide in.
    lights = Lights(np.float32([[0.8, 1.8, -0.2], [-1.8, 0.1, 1.8]]), np.float32([[1, 1, 1], [0, 0, 0]]))
    scene_engine, f = at_receivers(lights, Params(levels=1, alpha=1e3))
    found = sampled_distribution(scene_engine, f, 5)
    assert found.blocked[0, 1] == 1, "under the slab"
    assert found.blocked[0, 0] == 0, "in the open"
    picked = np.isfinite(found.entropy[0])
    assert (found.entropy[0][picked] == 0).all() and (found.effective_lights[0][picked] == 1).all()
    assert found.level_shares.tolist() == [1.0, 0.0] and np.isnan(found.level_blocked_shares[1])


def test_a_frame_without_shadow_samples() -> None:
    """It has no picks of its own, and no lists to draw members from; both are made for the survey."""
    f = frame(shadow_samples=0)
    assert f.hierarchy.members is None
    with pytest.raises(LabError, match="shadow_samples=0"):
        shadow_distribution(f)
    assert same(sampled_distribution(engine(), f, 4), shadow_distribution(frame(shadow_samples=4)))


def test_no_picks_at_all() -> None:
    f = frame()
    nothing = dataclasses.replace(f.gbuffer, depth=np.zeros_like(f.gbuffer.depth))
    found = sampled_distribution(engine(), dataclasses.replace(f, gbuffer=nothing), 2)
    assert np.isnan(found.entropy).all() and found.level_shares.sum() == 0 and found.top_lights() == []
    assert math.isnan(found.summary()["entropy"]) and math.isnan(found.summary()["blocked"])
    assert found.picks_histogram()[0].tolist() == [0, 1]


@pytest.mark.parametrize("picks", [0, -1, 5000, 1.5])
def test_the_number_of_picks_is_checked(picks: Any) -> None:
    with pytest.raises(LabError, match="picks"):
        sampled_distribution(engine(), frame(), picks)


def test_a_survey_can_be_cancelled() -> None:
    def stop(share: float, _: str) -> None:
        if share > 0:
            raise Cancelled

    with pytest.raises(Cancelled):
        sampled_distribution(engine(), frame(), 64, stop)


@pytest.mark.parametrize("importance", [True, False])
@pytest.mark.parametrize("picks", [None, 20])
def test_importance_on_and_off(importance: bool, picks: int | None) -> None:
    f = frame(importance=importance)
    said: list[float] = []
    found = compare_importance(engine(), f, picks, lambda share, _: said.append(share))
    assert said == sorted(said) and said[0] == 0 and said[-1] == 1
    for side, value in ((found.on, True), (found.off, False)):
        wanted = frame(importance=value)
        assert side.frame.params == wanted.params
        for (name, mine), (_, other) in zip(arrays(side.frame), arrays(wanted), strict=True):
            np.testing.assert_array_equal(mine, other, err_msg=name)
        plain = frame(importance=value, filter="none")
        np.testing.assert_array_equal(side.unfiltered.colour, plain.image.colour)
        np.testing.assert_array_equal(side.unfiltered.shadow_ratio, plain.image.shadow_ratio)
        assert not np.array_equal(side.unfiltered.colour, side.frame.image.colour)
        own = shadow_distribution(wanted) if picks is None else sampled_distribution(engine(), wanted, picks)
        assert same(side.distribution, own)
    assert found.off.distribution.summary()["entropy"] > found.on.distribution.summary()["entropy"] + 0.2
