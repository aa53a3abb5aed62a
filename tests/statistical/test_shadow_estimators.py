"""What S, U and the average visibility are expected to be, exactly, from every light and every member; z-tests."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

from lab.params import Params

from ..oracle_geometry.grids import contributions, member_shares, omegas, pick_weights
from ..oracle_geometry.rays import free
from ..oracle_geometry.scenes import Array, occluded_room, triangles_of, wall_lights
from ..oracle_geometry.statistics import accept, same_distribution, z_test
from ..oracle_geometry.trials import NORMAL, Trials, draw

LIGHTS = wall_lights(3, 60)
COMMON: dict[str, Any] = {"levels": 3, "alpha": 0.7, "shadow_samples": 4}
TRIANGLES = triangles_of(occluded_room(LIGHTS))


@dataclass(frozen=True)
class Expected:
    """Expectations of every receiver by brute force; (p, m) p_i, (p, m, n) the rest."""

    pick: Array
    c: Array
    share: Array
    omega: Array
    visible: Array

    def mean_visible(self) -> Any:
        return np.einsum("pm,mn,pn->p", self.pick, self.share, self.visible)

    def s(self) -> Any:
        return np.einsum("pm,mn,pmn,pn->p", self.pick, self.share, self.omega, self.visible)

    def u(self) -> Any:
        return np.einsum("pm,mn,pmn->p", self.pick, self.share, self.omega)

    def s_rgb(self) -> Any:
        return np.einsum("pmc,mn,pmn,pn->pc", self.c, self.share, self.omega, self.visible)

    def u_rgb(self) -> Any:
        return np.einsum("pmc,mn,pmn->pc", self.c, self.share, self.omega)


def expectations(t: Trials, params: Params) -> Expected:
    h = t.hierarchy
    c = contributions(h, t.position, t.normal, params, t.radius)
    f = pick_weights(h, c, params)
    n = int(h.offset[1])
    lifted = t.position + 2e-5 * NORMAL
    origin = np.repeat(lifted, n, axis=0)
    target = np.tile(h.position[:n].astype(np.float64), (len(t.position), 1))
    is_free, sure = free(TRIANGLES, origin, target, edge=1e-5, ends=1e-4)
    # Some light of an even choice lies in the receiver's own plane, where its weight is zero anyway.
    assert sure.mean() > 0.97
    return Expected(
        pick=f / f.sum(axis=1, keepdims=True),
        c=np.where((f > 0)[..., None], c, 0),
        share=member_shares(h, params.construction),
        omega=omegas(h, t.position, t.normal, params),
        visible=is_free.reshape(len(t.position), n).astype(np.float64),
    )


@cache
def observed(frames: int = 4, **settings: Any) -> tuple[Trials, Params]:
    params = Params(**COMMON | settings)
    return draw(LIGHTS, params, copies=1500, frames=frames, trace=True), params


CASES: dict[str, dict[str, Any]] = {
    "ours": {},
    "race": {"picker": "race"},
    "even picks": {"importance": False},
    "scatter": {"construction": "scatter"},
    "from level 2": {"first_shadow_level": 2},
    "no cap, mean_energy": {"omega_max": "none", "lobe": "mean_energy"},
    "low cap": {"omega_max": 0.5},
    "softened": {"falloff": "softened", "clamp_distance": 0.1},
}


@pytest.mark.parametrize("case", CASES)
def test_average_visibility_is_the_all_rays_value(case: str) -> None:
    """E[mean V] = sum_i p_i E_members[V]."""
    t, params = observed(shadow_estimator="average", **CASES[case])
    wanted = expectations(t, params)
    v = wanted.mean_visible()
    assert ((v > 0.1) & (v < 0.97)).sum() >= 4, "the room hides too little or too much"
    assert accept(z_test(t.shadowed[..., 0], v, rounding=1e-4))
    assert np.isin(t.shadowed, np.arange(5) / 4).all() and (t.weight == 1).all()
    assert not accept(z_test(t.shadowed[..., 0], 0.9 * v))
    by_centre = wanted.pick[:, : wanted.visible.shape[1]]
    alone = (by_centre * wanted.visible).sum(1) / np.maximum(by_centre.sum(1), 1e-9)
    assert not accept(z_test(t.shadowed[..., 0], alone)), "as if only input lights were picked"


@pytest.mark.parametrize("case", CASES)
def test_s_and_u_of_the_ratio(case: str) -> None:
    """E[U] = sum_i p_i sum_j P(j|i) omega_ij; E[S] the same with V_j."""
    t, params = observed(**CASES[case])
    wanted = expectations(t, params)
    s, u = wanted.s(), wanted.u()
    assert (s < 0.95 * u).sum() >= 3
    assert accept(z_test(t.weight[..., 0], u, rounding=2e-4))
    assert accept(z_test(t.shadowed[..., 0], s, rounding=2e-4))
    # Wrong ideas that the same statistics tell apart: V and omega independent, members drawn evenly.
    assert not accept(z_test(t.shadowed[..., 0], u * wanted.mean_visible()))
    even = (wanted.share > 0) / (wanted.share > 0).sum(axis=1, keepdims=True)
    assert not accept(
        z_test(t.shadowed[..., 0], np.einsum("pm,mn,pmn,pn->p", wanted.pick, even, wanted.omega, wanted.visible))
    )


@pytest.mark.parametrize("case", ["ours", "race", "even picks", "from level 2"])
def test_s_and_u_of_the_ratio_in_rgb(case: str) -> None:
    """Each sample times F / f_i * c_i: the sum over the picked levels' lights of what they send."""
    t, params = observed(shadow_estimator="ratio_rgb", **CASES[case])
    wanted = expectations(t, params)
    scale = wanted.u_rgb().max()
    for found, mean in ((t.shadowed, wanted.s_rgb()), (t.weight, wanted.u_rgb())):
        for channel in range(3):
            assert accept(z_test(found[..., channel], mean[:, channel], rounding=2e-4 * scale))
            assert not accept(z_test(found[..., channel], 1.15 * mean[:, channel]))


def test_corrected_takes_the_same_s_against_one() -> None:
    t, params = observed(shadow_estimator="corrected", omega_max=8.0)
    wanted = expectations(t, params)
    assert (t.weight == 1).all()
    assert accept(z_test(t.shadowed[..., 0], wanted.s(), rounding=2e-4))
    assert not accept(z_test(t.shadowed[..., 0], expectations(t, params.replace(omega_max=0.5)).s()))


def test_reservoir_and_race_agree() -> None:
    """One distribution of S and of U, whichever picker."""
    (a, _), (b, _) = observed(), observed(picker="race")
    p_values = []
    for p in range(a.shadowed.shape[1]):
        for name in ("shadowed", "weight"):
            x, y = getattr(a, name)[:, p, 0], getattr(b, name)[:, p, 0]
            edges = np.unique(np.quantile(np.concatenate([x, y]), np.linspace(0, 1, 12)))
            bins = [np.histogram(v, bins=[-1, *edges[1:-1], 99])[0] for v in (x, y)]
            p_values.append(same_distribution(*bins))
    assert accept(p_values)
    other, _ = observed(importance=False)
    assert not accept(z_test(a.shadowed[..., 0], other.shadowed[..., 0].mean(axis=0)))


@pytest.mark.parametrize("candidates", [1, 3, 8])
@pytest.mark.parametrize(("samples", "settings"), [(1, {}), (16, {}), (16, {"picker": "race"})])
def test_samples_add_up_like_independent_ones(samples: int, settings: dict[str, Any], candidates: int) -> None:
    """The variance of a mean of k samples is that of one, over k: the samples are not copies of each other.

    Of m candidates one is taken in proportion to omega, and stands for their mean: of a grid light the expected square
    is then (E[omega^2 V] + (m - 1) E[omega] E[omega V]) / m, which is less.
    """
    # One receiver sees few members well: over 6,000 draws of it the variance itself would deviate by 10 %.
    t, params = observed(frames=16, shadow_samples=samples, member_candidates=candidates, **settings)
    wanted = expectations(t, params)
    omega, m = wanted.omega, candidates
    own = np.einsum("mn,pmn,pn->pm", wanted.share, omega**2, wanted.visible)
    crossed = np.einsum("mn,pmn->pm", wanted.share, omega)
    crossed *= np.einsum("mn,pmn,pn->pm", wanted.share, omega, wanted.visible)
    square = np.einsum("pm,pm->p", wanted.pick, (own + (m - 1) * crossed) / m)
    variance = (square - wanted.s() ** 2) / samples
    assert np.allclose(t.shadowed[..., 0].var(axis=0), variance, rtol=0.15)


def test_candidates_change_noise_and_not_the_mean() -> None:
    """E[S] and E[U] are those of a single draw; a choice in proportion to anything but omega would shift S."""
    t, params = observed(member_candidates=8, omega_max="none")
    wanted = expectations(t, params)
    assert accept(z_test(t.weight[..., 0], wanted.u(), rounding=2e-4))
    assert accept(z_test(t.shadowed[..., 0], wanted.s(), rounding=2e-4))
    assert not accept(z_test(t.shadowed[..., 0], wanted.u() * wanted.mean_visible()))


def raised_cosine(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Density (1 + cos(pi x)) / 2 on [-1, 1], by rejection."""
    x = rng.uniform(-1, 1, (*shape, 24))
    taken = rng.random(x.shape) < (1 + np.cos(np.pi * x)) / 2
    assert taken.any(axis=-1).all()
    return np.take_along_axis(x, taken.argmax(axis=-1)[..., None], axis=-1)[..., 0]


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_average_visibility_of_jittered_points(scale: float) -> None:
    """The paper's samples: sum_i p_i E_q[V] with q around the centre; its integral by our own random points."""
    t, params = observed(
        shadow_points="jitter", deviation_scale=scale, shadow_estimator="average", first_shadow_level=1
    )
    wanted, h = expectations(t, params), t.hierarchy
    rng = np.random.default_rng(9)
    draws = 1200
    judge = []
    for p in range(len(t.position)):
        light = rng.choice(len(h.position), draws, p=wanted.pick[p])
        reach = scale * np.pi * h.deviation[light].astype(np.float64)
        q = h.position[light] + reach * raised_cosine(rng, (draws, 3))
        judge.append(free(TRIANGLES, np.tile(t.position[p] + 2e-5 * NORMAL[p], (draws, 1)), q)[0])
    mine = np.stack(judge, axis=1).astype(np.float64)
    error = np.sqrt(mine.var(axis=0) / draws + t.shadowed[..., 0].var(axis=0) / len(t.shadowed))
    z = (mine.mean(axis=0) - t.shadowed[..., 0].mean(axis=0)) / np.maximum(error, 1e-9)
    assert (np.abs(z) < 4).all()
    assert ((mine.mean(axis=0) > 0.05) & (mine.mean(axis=0) < 0.95)).sum() >= 4
    members = wanted.mean_visible()
    assert not accept(z_test(t.shadowed[..., 0], members)), "members and jitter differ here"
