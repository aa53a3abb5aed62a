"""lab.irradiance, the hierarchy as a library: exact where it must be, and blind to how the world is placed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import lab
from lab.errors import LabError
from lab.params import Params

from ..oracle import cases
from ..oracle import lighting as oracle

QUARTER_TURNS = [
    [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
    [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
]


def irradiance(lights, position, normal, params, scene_radius=None):
    return lab.irradiance(lab.build_hierarchy(lights, params), position, normal, params, scene_radius=scene_radius)


def assert_same_light(got, want):
    np.testing.assert_allclose(got, want, rtol=1e-4, atol=1e-4 * np.mean(want) + 1e-30)


@pytest.mark.parametrize("lights", cases.CLOUDS.values(), ids=cases.CLOUDS)
@pytest.mark.parametrize("falloff", ["clamped", "softened"])
def test_huge_alpha_is_the_sum_over_every_light(lights, falloff):
    lights = lights()
    centre, size = np.median(lights.position, axis=0), np.median(np.ptp(lights.position, axis=0))
    position, normal = cases.points(150, scale=float(size), shift=centre)
    params = Params(alpha=1e6, falloff=falloff, clamp_distance=0.1)
    got = irradiance(lights, position, normal, params, scene_radius=float(size))
    assert_same_light(got, oracle.exact_sum(lights, position, normal, params, float(size)))


ANY = {  # all but gather_range: half_open loses flux by design
    "levels": ["auto", "demo", 1, 4],
    "construction": ["gather", "scatter"],
    "carry_moments": [True, False],
    "centre_weight": ["flux", "count"],
    "lobe": ["moments", "mean_energy", "mean"],
    "receiver": ["hard", "soft"],
    "alpha": [0.5, 1, 2, 1e5],
    "first_level": [0, 1],
    "falloff": ["clamped", "softened"],
    "clamp_distance": [0, 0.01, 0.3],
    "bounds_scale": [1, 1.1, 2],
}


@pytest.mark.parametrize("normal", [(0.0, -0.6, 0.8), None], ids=["oriented", "isotropic"])
@pytest.mark.parametrize("seed", range(40))
def test_one_light_is_the_exact_point_light_for_any_settings(normal, seed):
    rng = np.random.default_rng(seed)
    params = Params(**{name: values[rng.integers(len(values))] for name, values in ANY.items()})
    light = cases.one_light(normal)
    away = rng.normal(size=(60, 3)) * np.geomspace(1e-2, 1e2, 60)[:, None]
    position, normals = (light.position + away).astype(np.float32), cases.unit_vectors(rng, 60)
    got = irradiance(light, position, normals, params, scene_radius=2.0)
    want = oracle.exact_sum(light, position, normals, params, 2.0)
    assert (want > 0).any()
    assert np.all(np.abs(got - want) <= 1e-4 * want + 1e-5 * want.max(axis=0))


@pytest.mark.parametrize(
    "settings", [{}, {"construction": "scatter", "alpha": 2}, {"first_level": 1, "receiver": "soft"}]
)
class TestPlacement:
    """Unshadowed light does not know where the origin is, how long a metre is, or which axis is up."""

    def prepare(self, settings):
        self.lights, self.params = cases.mixed_cloud(), Params(clamp_distance=0.02, **settings)
        self.position, self.normal = cases.points(200, seed=8)
        self.plain = irradiance(self.lights, self.position, self.normal, self.params)
        assert self.plain.mean() > 0.1

    @pytest.mark.parametrize("shift", [(3.0, -1.5, 0.25), (10.0, -20.0, 5.0)])
    def test_translation(self, settings, shift):
        self.prepare(settings)
        moved = cases.make_lights(self.lights.position + np.float32(shift), self.lights.flux, self.lights.normal)
        got = irradiance(moved, self.position + np.float32(shift), self.normal, self.params)
        np.testing.assert_allclose(got, self.plain, rtol=2e-3, atol=1e-4 * self.plain.mean())
        assert np.median(np.abs(got / np.maximum(self.plain, 1e-30) - 1)) < 2e-5

    @pytest.mark.parametrize("scale", [1e-3, 3.7, 1e6])
    def test_scale(self, settings, scale):
        self.prepare(settings)
        scaled = cases.make_lights(self.lights.position * np.float32(scale), self.lights.flux, self.lights.normal)
        got = irradiance(scaled, self.position * np.float32(scale), self.normal, self.params)
        assert_same_light(got.astype(np.float64) * scale**2, self.plain)

    @pytest.mark.parametrize("turn", QUARTER_TURNS)
    def test_quarter_turns(self, settings, turn):
        self.prepare(settings)
        turn = np.array(turn, np.float32).T
        turned = cases.make_lights(self.lights.position @ turn, self.lights.flux, self.lights.normal @ turn)
        assert_same_light(irradiance(turned, self.position @ turn, self.normal @ turn, self.params), self.plain)

    def test_order_of_the_lights(self, settings):
        self.prepare(settings)
        order = np.random.default_rng(9).permutation(len(self.lights))
        shuffled = cases.make_lights(self.lights.position[order], self.lights.flux[order], self.lights.normal[order])
        np.testing.assert_allclose(irradiance(shuffled, self.position, self.normal, self.params), self.plain, rtol=2e-6)

    def test_order_of_the_points(self, settings):
        self.prepare(settings)
        order = np.random.default_rng(10).permutation(len(self.position))
        got = irradiance(self.lights, self.position[order], self.normal[order], self.params)
        np.testing.assert_allclose(got, self.plain[order], rtol=2e-6)

    @pytest.mark.parametrize("factor", [1e-4, 1e6])
    def test_flux_is_a_factor(self, settings, factor):
        self.prepare(settings)
        bright = cases.make_lights(self.lights.position, self.lights.flux * np.float32(factor), self.lights.normal)
        got = irradiance(bright, self.position, self.normal, self.params)
        assert_same_light(got.astype(np.float64) / factor, self.plain)


@pytest.mark.parametrize("first_level, receiver", list(itertools.product([0, 1], ["hard", "soft"])))
def test_matches_the_oracle(first_level, receiver):
    lights = cases.cloud()
    params = Params(first_level=first_level, receiver=receiver, alpha=1.5)
    hierarchy = lab.build_hierarchy(lights, params)
    position, normal = cases.points(700, seed=11)  # more than a tile of points
    radius = float(np.linalg.norm(np.ptp(lights.position.astype(np.float64), axis=0)) / 2)
    want = oracle.light(hierarchy, position, normal, params, radius).irradiance
    assert_same_light(lab.irradiance(hierarchy, position, normal, params), want)


def test_interleave_and_shadow_settings_do_not_count():
    hierarchy = lab.build_hierarchy(cases.cloud())
    position, normal = cases.points(50)
    plain = lab.irradiance(hierarchy, position, normal)
    other = lab.irradiance(hierarchy, position, normal, Params(interleave=4, shadow_samples=16, seed=5))
    np.testing.assert_array_equal(plain, other)


def test_larger_alpha_is_nearer_to_the_exact_sum():
    lights = cases.cloud(2000)
    hierarchy = lab.build_hierarchy(lights)
    position, normal = cases.points(400, seed=12)
    exact = oracle.exact_sum(lights, position, normal, Params(), 1.4)
    errors = []
    for alpha in (0.5, 1, 2, 4, 16):
        got = lab.irradiance(hierarchy, position, normal, Params(alpha=alpha), scene_radius=1.4)
        errors.append(float(np.mean((got - exact) ** 2)))
    assert (
        errors == sorted(errors, reverse=True) and errors[2] < 0.5 * errors[0] and errors[4] < 1e-6 * np.mean(exact**2)
    )


def test_shapes_and_messages():
    hierarchy = lab.build_hierarchy(cases.cloud(20))
    assert lab.irradiance(hierarchy, np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)
    one = lab.irradiance(hierarchy, [[0, 0, 5]], [[0, 0, -1]])
    assert one.shape == (1, 3) and one.dtype == np.float32
    for positions, normals, said in [
        (np.zeros((4, 2)), np.zeros((4, 3)), r"positions: expected shape \(n, 3\), got \(4, 2\)"),
        (np.zeros((4, 3)), np.zeros((5, 3)), "4 positions and 5 normals"),
        ([[0, np.nan, 0]], np.zeros((1, 3)), "positions: row 0"),
    ]:
        with pytest.raises(LabError, match=said):
            lab.irradiance(hierarchy, positions, normals)
